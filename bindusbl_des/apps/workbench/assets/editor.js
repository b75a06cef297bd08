// The scenario as text, with its mistakes at their lines; and a form of all its keys.

// How long (ms) one must not type until the text is kept.
const REST = 600;
// So many rows of the form are shown at once.
const MOST_ROWS = 40;

export class Editor {
  constructor(bench) {
    Object.assign(this, { bench, text: byId("yaml"), lines: byId("lines"), resting: null, marked: new Map() });
    this.text.addEventListener("input", () => {
      this.number();
      clearTimeout(this.resting);
      this.resting = setTimeout(() => this.keep(), REST);
    });
    this.text.addEventListener("blur", () => this.resting && this.keep());
    this.text.addEventListener("scroll", () => { this.lines.scrollTop = this.text.scrollTop; });
    bench.on("desk", ({ text }) => this.show(text));
    bench.on("look", (look) => this.tell(look));
  }
  keep() {
    clearTimeout(this.resting);
    this.resting = null;
    if (this.text.value !== this.bench.desk?.text) this.bench.ask("text", { text: this.text.value });
  }
  show(text) {
    if (this.resting || this.text.value === text) return; // one is typing
    const { selectionStart, selectionEnd, scrollTop } = this.text;
    this.text.value = text;
    this.text.setSelectionRange(selectionStart, selectionEnd);
    this.text.scrollTop = scrollTop;
    this.number();
  }
  number() {
    const count = this.text.value.split("\n").length;
    this.lines.replaceChildren(...Array.from({ length: count }, (_, i) => make("span", { class: this.marked.get(i + 1) ?? "" }, `${i + 1}\n`)));
    this.lines.scrollTop = this.text.scrollTop;
  }
  tell({ mistakes, warnings }) {
    this.marked = new Map([...warnings.map(({ line }) => [line, "warned"]), ...mistakes.map(({ line }) => [line, "bad"])]);
    this.number();
    const item = (kind) => ({ line, column, key, message }) => {
      const go = make("button", { type: "button" }, line ? `line ${line}` : "file");
      go.addEventListener("click", () => this.go(line, column));
      return make("li", { class: kind }, go, ` ${key ? `${key}: ` : ""}${message}`);
    };
    const found = [...mistakes.map(item("bad")), ...warnings.map(item("warned"))];
    byId("mistakes").replaceChildren(...(found.length ? found : [make("li", { class: "fine" }, "No mistakes, no warnings.")]));
  }
  go(line, column) {
    const before = this.text.value.split("\n").slice(0, Math.max(line - 1, 0)), start = before.reduce((sum, it) => sum + it.length + 1, 0);
    this.text.focus();
    this.text.setSelectionRange(start + Math.max(column - 1, 0), start + (this.text.value.split("\n")[line - 1] ?? "").length);
    this.text.scrollTop = Math.max(line - 6, 0) * parseFloat(getComputedStyle(this.text).lineHeight);
  }
}

// Every key of a scenario: what it is, its unit and range, and its value; what is given comes first.
export async function keysForm(bench) {
  const keys = await (await fetch("keys")).json();
  const shown = () => {
    const words = byId("find").value.toLowerCase().split(/\s+/).filter(Boolean), given = bench.desk?.given ?? {};
    const holds = ({ key, meaning, choices }) => words.every((word) => `${key} ${meaning} ${choices.join(" ")}`.toLowerCase().includes(word));
    const found = keys.filter((row) => (words.length ? holds(row) : row.key in given));
    byId("found").textContent = words.length ? `${found.length} settings${found.length > MOST_ROWS ? `, of which the first ${MOST_ROWS}` : ""}` : "What the scenario gives; find others by a word. An empty field is the default.";
    byId("rows").replaceChildren(...found.slice(0, MOST_ROWS).map((row) => keyRow(bench, row, given[row.key])));
  };
  byId("find").addEventListener("input", shown);
  bench.on("desk", () => byId("rows").contains(document.activeElement) || shown());
  shown();
}

// A slider from nothing to twice the value, as far as the key's range goes; what it means is predicted as it moves.
function slider(key, kind, range, value) {
  if (!/number/.test(kind) || !Number.isFinite(value)) return null;
  const [, low = 0] = />=? ?([-\d.e]+)/.exec(range) ?? [], [, high = Infinity] = /<=? ?([-\d.e]+)/.exec(range) ?? [];
  const max = Math.min(+high, value > 0 ? 2 * value : 1), min = Math.max(+low, value < 0 ? 2 * value : 0);
  const step = /whole/.test(kind) ? 1 : +(max / 100).toPrecision(1) || 0.01;
  const made = make("input", { type: "range", min: /whole/.test(kind) ? min : Math.ceil(min / step - 1e-9) * step, max, step, "aria-label": `${key}, tried as it moves` });
  made.value = value;
  return made;
}

function keyRow(bench, { key, kind, choices, unit, default: usual, range, meaning, condition }, value) {
  const written = value === undefined ? "" : typeof value === "string" ? value : JSON.stringify(value);
  const words = choices.filter((it) => it !== "module:object"), isChoice = words.length > 0 && (written === "" || words.includes(written));
  const input = isChoice
    ? make("select", {}, make("option", { value: "" }, `${usual} (default)`), ...words.map((word) => make("option", { value: word }, word)))
    : make("input", { placeholder: usual, spellcheck: "false" });
  input.value = written;
  const keep = () => { bench.chart.trying = false; bench.ask("key", { key, value: input.value }); };
  input.addEventListener("change", keep);
  const slide = isChoice ? null : slider(key, kind, range, Number(written === "" ? usual : written));
  slide?.addEventListener("input", () => { input.value = slide.value; bench.chart.try({ keys: { [key]: slide.value } }); });
  slide?.addEventListener("change", keep);
  const facts = [unit && unit !== "1" ? unit : "", isChoice ? "" : `${kind} ${range}`.trim(), condition ? `only with ${condition}` : ""].filter(Boolean).join("; ");
  return make("div", { class: `row${value === undefined ? "" : " given"}` }, make("label", {}, make("code", {}, key), input), ...(slide ? [slide] : []), make("p", {}, `${meaning}${facts ? ` (${facts})` : ""}`));
}
