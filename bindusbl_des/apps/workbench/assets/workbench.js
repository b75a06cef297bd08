// The page of the workbench: what the server tells is shown, what is done here is told to the server.
// Names such as `make`, `byId` and `significant` are those of all pages (base.js).

import { Chart } from "./chart.js";
import { Editor, keysForm } from "./editor.js";
import { Jobs } from "./jobs.js";
import { Playing } from "./playing.js";

document.documentElement.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
startTheme();

// What everybody here knows: the scenario and its version, what it looks like, what is predicted.
const bench = { version: 0, desk: null, look: null, forecast: null, jobs: [], asked: 0 };
const listeners = { desk: [], look: [], forecast: [], tried: [], jobs: [], compared: [] };
bench.on = (what, listener) => listeners[what].push(listener);
const heard = (what, message) => listeners[what].forEach((listener) => listener(message));

let quiet = 0;
export function say(text, bad = false) {
  const said = byId("said");
  said.textContent = text;
  said.classList.toggle("bad", bad);
  clearTimeout(quiet);
  quiet = setTimeout(() => { said.textContent = ""; }, bad ? 9000 : 4000);
}
bench.say = say;

// The server, asked again every second while it does not answer.
let socket = null;
function connect() {
  const address = new URL("talk", location.href);
  address.protocol = "ws:";
  socket = new WebSocket(address);
  socket.addEventListener("open", () => { byId("lost").hidden = true; });
  socket.addEventListener("message", ({ data }) => take(JSON.parse(data)));
  socket.addEventListener("close", () => { byId("lost").hidden = false; setTimeout(connect, 1000); });
}
// Asks the server for something; changes name the version that they are made on.
bench.ask = (what, more = {}) => {
  if (socket?.readyState !== WebSocket.OPEN) { say("The workbench does not answer; nothing was changed.", true); return; }
  socket.send(JSON.stringify({ do: what, version: bench.version, ...more }));
};

function take(message) {
  if (message.is === "said") say(message.text, message.bad);
  else if (message.is === "desk") {
    bench.version = message.version;
    bench.desk = message;
    byId("file").textContent = message.file;
    byId("undo").disabled = !message.undo;
    byId("redo").disabled = !message.redo;
    heard("desk", message);
  } else if (message.is === "jobs") {
    bench.jobs = message.jobs;
    heard("jobs", message.jobs);
  } else if (message.is === "tried" || message.is === "compared") heard(message.is, message);
  else if (message.is === "choose") choose(message);
  else if (message.version === bench.version) { // of the scenario as it is, not as it was
    bench[message.is] = message;
    if (message.is === "look" && message.chart) {
      byId("name").textContent = message.chart.name;
      document.title = `${message.chart.name}: workbench`;
    }
    heard(message.is, message);
  }
}

function tabs() {
  const all = [...document.querySelectorAll("[role=tab]")];
  const choose = (tab) => all.forEach((other) => {
    other.setAttribute("aria-selected", other === tab);
    other.tabIndex = other === tab ? 0 : -1;
    byId(`tab-${other.dataset.tab}`).hidden = other !== tab;
  });
  bench.tab = (name) => choose(all.find((tab) => tab.dataset.tab === name));
  all.forEach((tab, i) => {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (event) => {
      const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!way) return;
      const next = all[(i + way + all.length) % all.length];
      choose(next);
      next.focus();
    });
  });
  choose(all[0]);
}

// A page of results takes the chart's place until one goes back.
bench.open = (address, name) => {
  byId("frame").hidden = false;
  byId("frame-name").textContent = name;
  byId("frame-alone").href = address;
  byId("page").src = address;
  byId("page").focus();
};
byId("frame-back").addEventListener("click", () => {
  byId("frame").hidden = true;
  byId("page").src = "about:blank";
});

// Files that are opened or dropped are kept beside the scenario, and then named in it.
async function drop(file, log = "") {
  const answer = await fetch(`drop?name=${encodeURIComponent(file.name)}&log=${log}`, { method: "POST", body: file }).catch(() => null);
  const told = await answer?.json().catch(() => null);
  if (!answer?.ok || !told) { say(told?.error ?? `${file.name}: cannot be kept`, true); return false; }
  if (!log) bench.ask("file", { name: told.name });
  return true;
}
// The tables of a recorded log are dropped together.
async function dropAll(files) {
  if (!files.some(({ name }) => /^(odometry|tracks)\.csv$/.test(name))) { files.forEach((file) => drop(file)); return; }
  const log = `log-${Date.now()}`, kept = await Promise.all(files.map((file) => drop(file, log)));
  if (!kept.every(Boolean)) return;
  bench.ask("begin", { kind: "replay", log });
  bench.tab("simulate");
}
byId("open").addEventListener("change", ({ target }) => { dropAll([...target.files]); target.value = ""; });
for (const kind of ["dragover", "dragleave", "drop"]) {
  addEventListener(kind, (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    document.body.classList.toggle("dropping", kind === "dragover");
    if (kind === "drop") dropAll([...event.dataTransfer.files]);
  });
}

// A file may be several things: one says which.
function choose({ name, among }) {
  byId("choose-name").textContent = `What is ${name}?`;
  byId("choose-among").replaceChildren(...[...among, "nothing"].map((words) => {
    const button = make("button", { type: "button" }, words);
    button.addEventListener("click", () => {
      byId("choose").close();
      if (words !== "nothing") bench.ask("file", { name, as: words });
    });
    return button;
  }));
  if (!byId("choose").open) byId("choose").showModal();
}

byId("undo").addEventListener("click", () => bench.ask("step", { by: -1 }));
byId("redo").addEventListener("click", () => bench.ask("step", { by: 1 }));
addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || event.target.matches("textarea, input")) return;
  event.preventDefault();
  bench.ask("step", { by: event.shiftKey ? 1 : -1 });
});

tabs();
bench.chart = new Chart(bench);
bench.editor = new Editor(bench);
keysForm(bench);
bench.playing = new Playing(bench);
new Jobs(bench);
window.announce = (text) => say(text); // what pages tell by a hidden line
connect();
Object.assign(bindusbl, { ready: true, bench });
