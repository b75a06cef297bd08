"use strict";
// Saves what the page draws: canvases as PNG or SVG, what stands in an SVG or a table as it is.
// Nothing leaves the page.

function save(text, name, type) {
  const link = make("a", { href: URL.createObjectURL(text instanceof Blob ? text : new Blob([text], { type })), download: name.replaceAll(" ", "_") });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

const csvOf = (rows) => rows.map((row) => row.map((it) => (typeof it === "number" ? (Number.isFinite(it) ? it : "") : `"${`${it ?? ""}`.replaceAll('"', '""')}"`)).join(",")).join("\r\n");

// What a row of buttons makes of each kind: a text or a promise of it.
const KINDS = { PNG: "image/png", SVG: "image/svg+xml", CSV: "text/csv" };
function saving(name, makers) {
  const buttons = Object.entries(makers).map(([kind, maker]) => {
    const button = make("button", { type: "button", "aria-label": `Save ${name} as ${kind}` }, kind);
    button.addEventListener("click", async () => save(await maker(), `${name}.${kind.toLowerCase()}`, KINDS[kind]));
    return button;
  });
  return make("div", { class: "save on-screen" }, "save ", ...buttons);
}

// Makers of a picture of a canvas on its ground, below it the key to its lines ({ label, stroke, dash }) if it has several.
// `draw` draws it anew, on it and on the `others` that it is made of.
function pictures(canvas, draw, { others = [], key = () => [] } = {}) {
  const whole = (finish) => {
    const sheet = canvas(), ratio = sheet.width / sheet.clientWidth, lines = key(), font = `${12 * ratio}px system-ui, sans-serif`;
    const context = make("canvas").getContext("2d"), copy = context.canvas, places = [];
    context.font = font;
    let [x, y] = [12 * ratio, sheet.height + 14 * ratio];
    for (const { label } of lines) {
      const wide = 36 * ratio + context.measureText(label).width;
      if (x > 12 * ratio && x + wide > sheet.width) [x, y] = [12 * ratio, y + 20 * ratio];
      places.push([x, y]);
      x += wide + 16 * ratio;
    }
    Object.assign(copy, { width: sheet.width, height: lines.length ? y + 14 * ratio : sheet.height });
    const drawWhole = () => {
      const own = getComputedStyle(sheet).backgroundColor;
      context.fillStyle = own === "rgba(0, 0, 0, 0)" ? colours.paper : own;
      context.fillRect(0, 0, copy.width, copy.height);
      draw();
      context.drawImage(sheet, 0, 0);
      lines.forEach(({ label, stroke, dash = [] }, i) => {
        const [px, py] = places[i];
        Object.assign(context, { strokeStyle: stroke, lineWidth: 2 * ratio, fillStyle: colours.ink, font, textBaseline: "middle" });
        context.setLineDash(dash);
        context.beginPath();
        context.moveTo(px, py);
        context.lineTo(px + 28 * ratio, py);
        context.stroke();
        context.fillText(label, px + 36 * ratio, py);
      });
    };
    return finish(copy, ratio, drawWhole, [copy, sheet, ...others]);
  };
  return {
    PNG: () => whole((copy, ratio, drawWhole) => { drawWhole(); return new Promise((done) => copy.toBlob(done)); }),
    SVG: () => whole((copy, ratio, drawWhole, all) => svgOf(all, ratio, drawWhole)),
  };
}

const short = (value) => +value.toFixed(2);
// A whole ellipse: arcs of canvases here are never parts.
function oval(path, x, y, across, down, turned = 0) {
  const [dx, dy] = [across * Math.cos(turned), across * Math.sin(turned)].map(short), half = `A${short(across)} ${short(down)} ${short(turned * 180 / Math.PI)} 1 1 `;
  return `${path}M${short(x + dx)} ${short(y + dy)}${half}${short(x - dx)} ${short(y - dy)}${half}${short(x + dx)} ${short(y + dy)}Z`;
}
// What each step of a path on a canvas is in an SVG.
const STEPS = {
  moveTo: (path, x, y) => `${path}M${short(x)} ${short(y)}`,
  lineTo: (path, x, y) => `${path}${path ? "L" : "M"}${short(x)} ${short(y)}`,
  rect: (path, x, y, width, height) => `${path}M${short(x)} ${short(y)}h${short(width)}v${short(height)}h${short(-width)}Z`,
  arc: (path, x, y, radius) => oval(path, x, y, radius, radius),
  ellipse: oval,
  closePath: (path) => `${path}Z`,
};
const { Path2D: PlainPath } = window;
class TracedPath extends PlainPath {
  constructor(...from) { super(...from); this.trace = from[0]?.trace ?? ""; }
}
for (const [name, step] of Object.entries(STEPS)) {
  TracedPath.prototype[name] = function (...at) { PlainPath.prototype[name].apply(this, at); this.trace = step(this.trace, ...at); };
}

// An SVG of what `draw` draws on canvases, the first of which has them all.  Their contexts are listened to while they draw as ever, so that
// whatever a plot or a map has is in its SVG; what one of them takes from another is there already.
function svgOf(canvases, ratio, draw) {
  const parts = [], clips = [], number = (names) => Object.entries(names).map(([name, value]) => ` ${name}="${value}"`).join("");
  const escaped = (text) => `${text}`.replace(/[<>&"]/g, (letter) => `&#${letter.charCodeAt(0)};`);
  const contexts = canvases.map((canvas) => canvas.getContext("2d"));
  const listen = (context) => {
    let path = "", clip = "";
    const held = [], { prototype } = CanvasRenderingContext2D;
    const add = (tag, own, inside = "") => {
      const { a, b, c, d, e, f } = context.getTransform(), matrix = [a, b, c, d, e, f].map((it) => +it.toFixed(4)).join(" ");
      const turned = matrix === "1 0 0 1 0 0" ? {} : { transform: `matrix(${matrix})` }, faint = context.globalAlpha < 1 ? { opacity: short(context.globalAlpha) } : {};
      const drawn = `<${tag}${number({ ...own, ...turned, ...faint })}${inside ? `>${inside}</${tag}>` : "/>"}`;
      parts.push(clip ? `<g clip-path="url(#${clip})">${drawn}</g>` : drawn);
    };
    // Programs other than browsers know no colours with alpha.
    const paint = (kind) => {
      const colour = context[`${kind}Style`], [, rgb, alpha] = /^rgba\((.*), ([\d.]+)\)$/.exec(colour) ?? [];
      return rgb ? { [kind]: `rgb(${rgb})`, [`${kind}-opacity`]: alpha } : { [kind]: colour };
    };
    const line = () => {
      const dash = context.getLineDash(), { lineJoin, lineCap } = context;
      return { fill: "none", ...paint("stroke"), "stroke-width": short(context.lineWidth), ...(dash.length ? { "stroke-dasharray": dash.map(short).join(" ") } : {}), ...(lineJoin === "miter" ? {} : { "stroke-linejoin": lineJoin }), ...(lineCap === "butt" ? {} : { "stroke-linecap": lineCap }) };
    };
    const words = (look) => (text, x, y) => {
      const [, weight, size, family] = /^(?:(\w+) )?([\d.]+)px (.*)$/.exec(context.font);
      const anchor = { center: "middle", right: "end", end: "end" }[context.textAlign], dy = { middle: "0.35em", top: "0.8em", bottom: "-0.2em" }[context.textBaseline];
      add("text", { x: short(x), y: short(y), ...(dy ? { dy } : {}), "font-family": escaped(family), "font-size": size, ...(weight ? { "font-weight": weight } : {}), ...(anchor ? { "text-anchor": anchor } : {}), ...look() }, escaped(text));
    };
    const heard = {
      save: () => held.push(clip), restore: () => { clip = held.pop() ?? ""; }, beginPath: () => { path = ""; },
      stroke: (own) => add("path", { d: own?.trace ?? path, ...line() }), fill: (own) => add("path", { d: own?.trace ?? path, ...paint("fill") }),
      fillRect: (x, y, width, height) => add("rect", { x: short(Math.min(x, x + width)), y: short(Math.min(y, y + height)), width: short(Math.abs(width)), height: short(Math.abs(height)), ...paint("fill") }),
      fillText: words(() => paint("fill")), strokeText: words(line),
      clip: (own) => {
        const { a, b, c, d, e, f } = context.getTransform();
        clips.push(`<clipPath id="clip${clips.length}"${clip ? ` clip-path="url(#${clip})"` : ""}><path d="${own?.trace ?? path}" transform="matrix(${[a, b, c, d, e, f]})"/></clipPath>`);
        clip = `clip${clips.length - 1}`;
      },
      drawImage: (from, x, y, width, height) => { if (!canvases.includes(from)) add("image", { href: from.toDataURL(), x: short(x), y: short(y), width: short(width), height: short(height), preserveAspectRatio: "none" }); },
    };
    for (const [name, step] of Object.entries(STEPS)) heard[name] = (...at) => { path = step(path, ...at); };
    for (const [name, hear] of Object.entries(heard)) context[name] = (...at) => { hear(...at); return prototype[name].apply(context, at); };
    return () => Object.keys(heard).forEach((name) => { delete context[name]; });
  };
  const quiet = contexts.map(listen);
  window.Path2D = TracedPath;
  try { draw(); } finally { window.Path2D = PlainPath; quiet.forEach((stop) => stop()); }
  const [{ width, height }] = canvases;
  return `<svg xmlns="http://www.w3.org/2000/svg" width="${short(width / ratio)}" height="${short(height / ratio)}" viewBox="0 0 ${width} ${height}"><defs>${clips.join("")}</defs>${parts.join("\n")}</svg>`;
}

// An SVG of the page as a file of its own, with the looks that the style sheet gives it.
function standalone(root) {
  const copy = root.cloneNode(true), own = copy.querySelectorAll("*");
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  root.querySelectorAll("*").forEach((from, i) => {
    const style = getComputedStyle(from);
    for (const name of ["fill", "stroke", "stroke-width", "stroke-dasharray", "opacity", "font-family", "font-size", "font-weight"]) own[i].setAttribute(name, style.getPropertyValue(name));
  });
  return new XMLSerializer().serializeToString(copy);
}
