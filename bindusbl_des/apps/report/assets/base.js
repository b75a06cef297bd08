"use strict";
// What every page needs: data, colours, elements, numbers. `bindusbl` shows tests what a page shows.

window.bindusbl = { ready: false, plots: {} };

const byId = (id) => document.getElementById(id);
const readData = () => JSON.parse(byId("data").textContent);
const calm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

function dressed(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "style") element.style.cssText = value;  // as an attribute the policy forbids it
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}
const make = (tag, attributes = {}, ...children) => dressed(document.createElement(tag), attributes, children);
const svg = (tag, attributes = {}, ...children) => dressed(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);

// Columns: zigzag differences in four byte planes, deflated; the packing is that of apps/report/page.py.
async function unpacker(packed = byId("packed").textContent) {
  const text = atob(packed);
  const deflated = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  return ({ at, length, quantum, order }) => {
    const steps = new Int32Array(length);
    const start = 4 * at;
    for (let i = 0; i < length; i++) {
      const z = bytes[start + i] | bytes[start + length + i] << 8
        | bytes[start + 2 * length + i] << 16 | bytes[start + 3 * length + i] << 24;
      steps[i] = (z >>> 1) ^ -(z & 1);
    }
    for (let pass = 0; pass < order; pass++) {
      for (let i = 1; i < length; i++) steps[i] = (steps[i] + steps[i - 1]) | 0;
    }
    const missing = -(2 ** 31);
    return Float64Array.from(steps, (step) => (step === missing ? NaN : step * quantum));
  };
}

// Replaces every packed column in a tree of data by its numbers.
function unpackAll(node, unpack) {
  if (Array.isArray(node)) return node.map((child) => unpackAll(child, unpack));
  if (node === null || typeof node !== "object") return node;
  if ("quantum" in node && "order" in node) return unpack(node);
  return Object.fromEntries(Object.entries(node).map(([k, child]) => [k, unpackAll(child, unpack)]));
}

// Colours come from the style sheet, so that a theme is one attribute.
const colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["paper", "sheet", "ink", "soft", "line", "grid", "accent", "shade", "sea",
    "hf", "mf", "collided", "plan", "land", "shore", "depth"]) {
    colours[name] = style.getPropertyValue("--" + name).trim();
  }
  colours.series = Array.from({ length: 8 }, (_, i) => style.getPropertyValue("--c" + i).trim());
}
// Dashes of plots, which count in dots.
const dashed = (...lengths) => lengths.map((it) => it * uPlot.pxRatio);
const DASHES = [dashed(), dashed(8, 4), dashed(2, 3), dashed(10, 3, 2, 3)];
const seriesColour = (i) => colours.series[i % colours.series.length];
const seriesDash = (i) => DASHES[(i + Math.floor(i / 8)) % DASHES.length];

// Cividis: even steps of lightness, the same for every kind of colour vision.
const CIVIDIS = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]];

function cividis(share) {
  const at = clamp(share, 0, 1) * (CIVIDIS.length - 1), k = Math.min(Math.floor(at), CIVIDIS.length - 2);
  return CIVIDIS[k].map((value, i) => Math.round(value + (at - k) * (CIVIDIS[k + 1][i] - value)));
}

// One polarity everywhere: dark is bad.  `share` is from the low end of what is shown to its high
// end, of which `more` says whether it is the bad one.
const shadeOf = (share, more) => cividis(more ? 1 - share : share);

// A ramp of these colours with what its ends mean.
function ramp(low, high, more) {
  const stops = Array.from({ length: 11 }, (_, i) => `rgb(${shadeOf(i / 10, more).join(",")})`).join(",");
  return make("div", { class: "ramp" }, make("span", {}, low), make("i", { style: `background:linear-gradient(90deg,${stops})` }), make("span", {}, high));
}

// What fills a place of which nothing is known: hatches, told from any colour.
function hatch(context, x, y, width, height) {
  context.save();
  context.beginPath();
  context.rect(x, y, width, height);
  context.clip();
  hatches(context, x, y, width, height);
  context.restore();
}

// Lines over a rectangle that fall to the left, or to the right, the same over any that overlap.
function hatches(context, x, y, width, height, colour = colours.soft, right = false) {
  const step = 7, from = right ? x - y - height : x + y;
  shape(context, { stroke: colour }, () => {
    for (let at = Math.floor(from / step) * step; at <= from + width + height; at += step) {
      context.moveTo(right ? at + y : at - y, y);
      context.lineTo(right ? at + y + height : at - y - height, y + height);
    }
  });
}

// Fills and strokes what `path` lays on a canvas, which is left as it was.
function shape(context, { fill, stroke, width = 1, dash = [], alpha = context.globalAlpha, shade = alpha, join = context.lineJoin }, path) {
  context.save();
  context.beginPath();
  path();
  if (fill) {
    Object.assign(context, { fillStyle: fill, globalAlpha: shade });
    context.fill();
  }
  if (stroke) {
    Object.assign(context, { strokeStyle: stroke, lineWidth: width, lineJoin: join, globalAlpha: alpha });
    context.setLineDash(dash);
    context.stroke();
  }
  context.restore();
}
const polygon = (context, corners) => { corners.forEach(([x, y]) => context.lineTo(x, y)); context.closePath(); };
const disc = (context, x, y, radius) => context.arc(x, y, radius, 0, 2 * Math.PI);
const starAt = (x, y, inner, outer) => Array.from({ length: 10 }, (_, i) => { // its corners
  const angle = -Math.PI / 2 + i * Math.PI / 5, radius = i % 2 ? inner : outer;
  return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
});
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

const repaints = [];
const onTheme = (repaint) => repaints.push(repaint);
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  readColours();
  repaints.forEach((repaint) => repaint());
}
function startTheme() {
  readColours();
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let chosen = false;
  dark.addEventListener("change", () => chosen || onPaper() || setTheme(dark.matches ? "dark" : "light"));
  byId("theme").addEventListener("click", () => {
    chosen = true;
    setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  });
  startPrinting();
}

// On paper all is light, as wide as the sheet and finely drawn, whatever the window shows.
const PAPER_RATIO = 3;
const onPaper = () => document.documentElement.classList.contains("paper");
const pixelRatio = () => (onPaper() ? PAPER_RATIO : window.devicePixelRatio || 1);
function startPrinting() {
  const root = document.documentElement, printing = matchMedia("print");
  let before = root.dataset.theme;
  const print = (on) => {
    if (on === onPaper()) return;
    if (on) before = root.dataset.theme;
    root.classList.toggle("paper", on);
    fillPage(on);
    setTheme(on ? "light" : before);
  };
  window.addEventListener("beforeprint", () => print(true));
  window.addEventListener("afterprint", () => print(false));
  printing.addEventListener("change", () => print(printing.matches));
}

// A map on paper is as high as what the rest of its page holds, where that is enough to see much.
const PAGE = 1020, LEAST = 280, MOST = 470; // pixels; a sheet of A4 less its margins
function fillPage(on) {
  const map = byId("map");
  if (!map) return;
  map.style.height = "";
  const top = (element) => element.getBoundingClientRect().top, beneath = map.closest("figure").offsetHeight - map.offsetHeight;
  const left = PAGE - (top(map) - top(byId("main"))) % PAGE - beneath;
  if (on && left > LEAST) map.style.height = `${Math.min(left, MOST)}px`;
}

// Tells those who listen to the page what they did; nothing speaks while time plays on.
function announce(text) { byId("said").textContent = text; }

// A canvas whose coordinates are CSS pixels; `draw(context, width, height)` paints it.
class Sheet {
  constructor(canvas, draw) {
    this.canvas = canvas;
    this.draw = draw;
    new ResizeObserver(() => this.paint()).observe(canvas);
    onTheme(() => this.paint());
    new IntersectionObserver(([{ isIntersecting }]) => {
      this.inView = isIntersecting;
      if (isIntersecting && this.stale) this.paint();
    }).observe(canvas);
  }
  // While time plays, what has been scrolled away waits until it is back.
  show(playing) { if (this.inView || !playing) this.paint(); else this.stale = true; }
  paint() {
    this.stale = false;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    const ratio = pixelRatio();
    const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== w || this.canvas.height !== h) {
      this.canvas.width = w;
      this.canvas.height = h;
    }
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    this.draw(context, width, height);
  }
}

// The first index whose value is above `value`, in sorted numbers.
function above(sorted, value) {
  let low = 0, high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] > value) high = middle; else low = middle + 1;
  }
  return low;
}

// A time: in seconds, from ten minutes on in hours and minutes; support/wording.py has the same.
const LONG = 600;
const sixty = (value) => `${value}`.padStart(2, "0");
function timed(seconds, digits = 1) {
  if (!(Math.abs(seconds) >= LONG)) return Number.isFinite(seconds) ? `${seconds.toFixed(digits)} s` : "–";
  const minutes = Math.round(seconds / 60);
  return `${Math.trunc(minutes / 60)}:${sixty(minutes % 60)} h`;
}

// An instant: in seconds, of missions that take ten minutes and more as h:mm:ss.
function instant(seconds, digits = 1) {
  if (!bindusbl.long) return `${seconds.toFixed(digits)} s`;
  const at = +seconds.toFixed(digits), whole = Math.floor(at), part = digits ? (at - whole).toFixed(digits).slice(1) : "";
  return `${Math.floor(whole / 3600)}:${sixty(Math.floor(whole / 60) % 60)}:${sixty(whole % 60)}${part}`;
}
const aloud = (seconds) => instant(seconds).replace(/ s$/, " seconds");
// What stands at its axis, whole minutes where it is long, and in a legend.
const MINUTES = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400, 172800, 432000, 864000];
const instants = (u, ticks) => ticks.map((it) => (bindusbl.long ? instant(it, it % 1 ? 1 : 0).replace(ticks.every((other) => other % 60 === 0) ? /:00$/ : "", "") : `${it} s`));
const timeWords = () => (bindusbl.long ? "time (h:mm)" : "time (s)");
const timeAxis = () => (bindusbl.long ? { values: instants, incrs: MINUTES } : {});
// What a legend tells of a value, a dash where there is none.
const told = (words) => (u, value) => (value === null || value === undefined ? "–" : words(value));
const timeSeries = () => ({ label: "time", value: told(instant) });

// A step of 1, 2 or 5 times a power of ten, not below `least`.
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((it) => it * power).find((it) => it >= least * 0.999);
}

function mean(values) { return values.reduce((sum, it) => sum + it, 0) / values.length; }
function quantile(values, share) {
  const sorted = Float64Array.from(values).sort();
  const place = share * (sorted.length - 1), whole = Math.floor(place);
  return sorted[whole] + (place - whole) * ((sorted[whole + 1] ?? sorted[whole]) - sorted[whole]);
}

// A number with so many digits that count, never with an exponent; support/wording.py has the same.
function significant(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (Math.abs(value) < 0.5e-6) return "0";
  const whole = Math.floor(Math.log10(Math.abs(value))) + 1;
  return value.toFixed(clamp(digits - whole, 0, 6));
}

// A mean and half its interval, two digits of that; and a mean with the ends of its interval, as many digits as tell these apart.
function withHalf(mean, half) {
  if (!(half > 1e-9 * Math.abs(mean))) return [significant(mean), Number.isFinite(half) ? "0" : "–"];
  const places = clamp(1 - Math.floor(Math.log10(half)), 0, 6);
  return [mean.toFixed(places), half < 0.5e-6 ? "<0.000001" : half.toFixed(places)];
}
function withEnds(mean, low, high) {
  const half = (high - low) / 2, apart = Math.floor(Math.log10(Math.abs(mean))) - Math.floor(Math.log10(half)) + 1;
  return [mean, low, high].map((value) => significant(value, Number.isFinite(apart) ? Math.max(3, apart) : 3));
}
