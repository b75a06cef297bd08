// The survey on a map that is dragged and drawn on: metres, north up; what is predicted as shades.

export const at = ([x, y]) => L.latLng(x, y);
const place = ({ lat, lng }) => [lat, lng];
const metres = (value) => `${Math.round(value * 10) / 10} m`;
// How far (pixels) arrow keys move a vessel, and with shift; how long (ms) until that is kept.
const STEP = 8, LEAP = 40, REST = 500;
// What is drawn by the button with an id.
const DRAWN = { "draw-area": "Polygon", "draw-land": "Polygon", "draw-keep-out": "Polygon", "draw-way": "Line" };
// What is told of each AUV: a name of the prediction, words, unit, factor.
const COLUMNS = [
  ["position_error_m", "mean error", "m", 1], ["position_error_p95_m", "95 % error", "m", 1], ["hf_coverage", "in HF range", "%", 100],
  ["fix_rate_hz", "fixes", "/min", 60], ["fix_age_max_s", "oldest fix", "s", 1],
];

export class Chart {
  constructor(bench) {
    Object.assign(this, { bench, chart: { outline: [], land: [], keep_out: [], ways: [], points: [] }, stations: [], markers: [], trying: false, waiting: null, id: 0, outline: "" });
    this.map = L.map("map", { crs: L.CRS.Simple, minZoom: -8, maxZoom: 6, zoomSnap: 0.25, zoomDelta: 0.5, wheelPxPerZoomLevel: 120, attributionControl: false, zoomControl: false, keyboard: true });
    L.control.zoom({ position: "topright" }).addTo(this.map);
    this.map.setView([0, 0], 0);
    L.control.scale({ imperial: false }).addTo(this.map);
    for (const [name, level] of [["grid", 250], ["shade", 260], ["shadows", 270], ["sea", 400]]) this.map.createPane(name).style.zIndex = level;
    this.layers = Object.fromEntries(["grid", "depths", "area", "shadows", "ways", "rings", "turns"].map((name) => [name, L.layerGroup().addTo(this.map)]));
    this.map.on("zoomend moveend resize", () => this.graticule());
    this.map.on("dragstart zoomstart", () => { this.fitted = false; });
    this.map.on("mousemove", ({ latlng }) => this.tellPlace(place(latlng)));
    this.map.on("pm:create", ({ shape, layer }) => this.drawn(shape, layer));
    this.map.on("pm:drawend", () => this.press(null));
    this.map.pm.setGlobalOptions({ snappable: false, hintlineStyle: { dashArray: [5, 5] } });
    bench.on("desk", ({ version }) => { if (version !== this.version) byId("worst").classList.add("stale"); this.version = version; });
    bench.on("look", (look) => this.show(look));
    bench.on("forecast", (told) => this.tell(told.found, told));
    bench.on("tried", (told) => this.tried(told));
    onTheme(() => this.bench.look && this.show(this.bench.look));
    this.listen();
  }
  listen() {
    const on = (id, act) => byId(id).addEventListener("click", act);
    on("add", () => this.keep([...this.stations, this.neediest()]));
    on("all", () => this.seeAll());
    for (const [id, shape] of Object.entries(DRAWN)) on(id, () => this.draw(shape, id));
    on("lanes", () => this.bench.ask("ways", { points: [] }));
    for (const id of ["edit", "erase"]) on(id, () => this.touch(this.touching === id ? null : id));
    byId("shade").addEventListener("change", () => this.bench.ask("shade", { shade: byId("shade").value }));
    new ResizeObserver(() => {
      this.map.invalidateSize({ animate: false });
      if (this.fitted) this.seeAll();
    }).observe(byId("map"));
  }
  // Drawing: a click a corner; the first again, or a double-click, ends it; escape gives up.
  draw(shape, button) {
    const on = byId(button).getAttribute("aria-pressed") !== "true";
    this.touch(null);
    this.map.pm.disableDraw();
    if (!on) return;
    this.map.pm.enableDraw(shape, { finishOn: shape === "Line" ? "dblclick" : null });
    this.press(button);
    this.drawing = button;
  }
  press(button) {
    for (const id of Object.keys(DRAWN)) byId(id).setAttribute("aria-pressed", id === button);
  }
  drawn(shape, layer) {
    layer.remove();
    const corners = layer.getLatLngs(), name = { "draw-land": "land", "draw-keep-out": "keep_out" }[this.drawing];
    if (shape === "Line") this.bench.ask("ways", { points: [...this.chart.points, corners.map(place)] });
    else if (name) this.bench.ask("shapes", { name, polygons: [...this.chart[name], corners[0].map(place)] });
    else this.bench.ask("area", { corners: corners[0].map(place) });
  }
  // What a click on a polygon does: its corners, and land itself, can be dragged; or land goes.
  touch(mode) {
    this.touching = mode;
    for (const id of ["edit", "erase"]) byId(id).setAttribute("aria-pressed", id === mode);
    byId("map").classList.toggle("erasing", mode === "erase");
    for (const layer of this.polygons ?? []) {
      layer.pm.disable();
      layer.pm.disableLayerDrag();
      if (mode !== "edit") continue;
      layer.pm.enable({ allowSelfIntersection: true });
      if (layer.options.key) layer.pm.enableLayerDrag();
    }
  }
  show({ chart }) {
    for (const id of ["add", "edit", "erase", ...Object.keys(DRAWN)]) byId(id).disabled = !chart; // mend it first
    if (!chart) return;
    this.chart = chart = { ways: [], points: [], shadows: [], ...chart };
    this.showDepths(chart.contours ?? []);
    this.showArea(chart);
    this.showWays(chart);
    this.showShadows(chart.shadows);
    if (!this.dragging) { this.stations = chart.stations.map((it) => [...it]); this.showVessels(); }
    byId("add").disabled = !chart.stations.length;
    byId("erase").disabled = !chart.land.length && !chart.keep_out.length;
    byId("lanes").disabled = chart.route === "lawnmower";
    if (!this.seen) { this.seen = true; this.seeAll(); }
    this.tellShapes(chart);
    if (chart.is_flown) this.tellFacts(chart);
    else {
      this.shadeBy(null);
      byId("auvs").hidden = true;
      byId("worst").textContent = "It cannot be flown like this; the reason stands under Scenario.";
    }
  }
  // Lines of equal depth, each with its depth at the middle of its longest.
  showDepths(contours) {
    const known = JSON.stringify(contours);
    if (known === this.depths) return;
    this.depths = known;
    this.layers.depths.clearLayers();
    for (const { depth, lines } of contours) {
      const longest = Math.max(...lines.map(({ length }) => length));
      for (const line of lines) {
        const shown = L.polyline(line.map(at), { className: "depth", interactive: false, pmIgnore: true, pane: "shadows" }).addTo(this.layers.depths);
        if (line.length === longest) shown.bindTooltip(`${depth} m`, { permanent: true, direction: "center", className: "depth-words" });
      }
    }
  }
  showArea({ outline, land, keep_out: keepOut }) {
    const known = JSON.stringify([outline, land, keepOut]);
    if (known === this.outline) return;
    this.outline = known;
    this.layers.area.clearLayers();
    const polygon = (corners, more) => {
      const layer = L.polygon(corners.map(at), { pmIgnore: false, ...more }).addTo(this.layers.area);
      layer.on("pm:edit pm:dragend", () => this.reshaped(layer));
      layer.on("click", () => this.touching === "erase" && more.key && this.erase(more.key, more.number));
      return layer;
    };
    const of = (key, all, className) => all.map((corners, number) => polygon(corners, { key, number, className }));
    this.polygons = [polygon(outline, { className: "area" }), ...of("keep_out", keepOut, "keep-out"), ...of("land", land, "land")];
    this.touch(this.touching);
  }
  // Sent once all corners of one act have moved.
  reshaped(layer) {
    const { key, number } = layer.options, { version } = this.bench;
    clearTimeout(this.resting);
    this.resting = setTimeout(() => {
      const corners = layer.getLatLngs()[0].map(place);
      if (version !== this.bench.version) return; // meanwhile it has gone, or is another
      if (!key) this.bench.ask("area", { corners });
      else if (corners.length < 3) this.erase(key, number);
      else this.bench.ask("shapes", { name: key, polygons: this.chart[key].map((it, i) => (i === number ? corners : it)) });
    }, 60);
  }
  erase(key, number) { this.bench.ask("shapes", { name: key, polygons: this.chart[key].filter((_, i) => i !== number) }); }
  // What land hides from vessels, within range.
  showShadows(shadows) {
    this.layers.shadows.clearLayers();
    for (const rings of shadows) L.polygon(rings.map((ring) => ring.map(at)), { className: "shadow", interactive: false, pmIgnore: true, pane: "shadows" }).addTo(this.layers.shadows);
  }
  // Land and keep-outs in a list: where they lie, and a button for each that takes it away.
  tellShapes({ land, keep_out: keepOut }) {
    const row = (key, name) => (corners, number) => {
      const box = L.polygon(corners.map(at)).getBounds(), [x, y] = place(box.getCenter()), words = `${name} ${number + 1}`;
      const remove = make("button", { type: "button", "aria-label": `Remove ${words}` }, "remove");
      remove.addEventListener("click", () => this.erase(key, number));
      const cell = (text) => make("td", {}, text);
      return make("tr", {}, make("th", { scope: "row" }, words), cell(`${corners.length} corners`), cell(`about ${metres(x)} N, ${metres(y)} E`), cell(remove));
    };
    const rows = [...land.map(row("land", "land")), ...keepOut.map(row("keep_out", "keep-out"))];
    byId("shapes").replaceChildren(rows.length ? make("table", {}, make("tbody", {}, ...rows)) : make("p", { class: "note" }, "None. Draw some on the chart, or drop a file of them on it."));
  }
  showWays({ ways, points }) {
    this.layers.ways.clearLayers();
    this.layers.turns.clearLayers();
    ways.forEach((way, auv) => {
      const color = seriesColour(auv);
      L.polyline(way.map(at), { className: "way", color, interactive: false, pmIgnore: true }).addTo(this.layers.ways);
      const name = make("span", { style: `color:${color}` }, `AUV${auv}`);
      L.marker(at(way[0]), { icon: L.divIcon({ className: "auv-name planned", html: name, iconSize: [0, 0], iconAnchor: [-4, 14] }), interactive: false, keyboard: false, pmIgnore: true }).addTo(this.layers.ways);
    });
    points.forEach((way, auv) => way.forEach((point, number) => {
      const turn = L.marker(at(point), { draggable: true, pmIgnore: true, icon: L.divIcon({ className: "turn", iconSize: [12, 12] }), alt: `way point ${number} of AUV${auv}` }).addTo(this.layers.turns);
      turn.getElement().style.borderColor = seriesColour(auv);
      turn.on("dragend", () => this.turned(auv, number, place(turn.getLatLng())));
      turn.getElement().addEventListener("keydown", (event) => {
        const moved = this.moved(event, point);
        if (moved) this.turned(auv, number, moved);
        else if (event.key === "Delete" || event.key === "Backspace") this.turned(auv, number, null);
      });
    }));
  }
  turned(auv, number, point) {
    const points = this.chart.points.map((way) => [...way]);
    points[auv].splice(number, 1, ...(point ? [point] : []));
    this.bench.ask("ways", { points: points.filter((way) => way.length) });
  }
  // Where arrow keys send what lies at a place; null for other keys.
  moved(event, [x, y]) {
    const way = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0] }[event.key];
    if (!way) return null;
    event.preventDefault();
    event.stopPropagation();
    const step = roundStep((event.shiftKey ? LEAP : STEP) / this.map.options.crs.scale(this.map.getZoom()));
    return [x + way[0] * step, y + way[1] * step];
  }
  showVessels() {
    while (this.markers.length > this.stations.length) this.markers.pop().remove();
    while (this.markers.length < this.stations.length) this.markers.push(this.vessel(this.markers.length));
    this.layers.rings.clearLayers();
    const { hf, mf } = this.chart.reach ?? { hf: 0, mf: 0 };
    this.rings = this.stations.map((station, number) => {
      this.markers[number].setLatLng(at(station));
      this.name(number);
      return [["hf", hf], ["mf", mf]].map(([className, radius]) => L.circle(at(station), { radius, className, interactive: false, pmIgnore: true }).addTo(this.layers.rings));
    });
    this.tellStations();
  }
  name(number) {
    const [x, y] = this.stations[number], words = `ASV${number}, ${metres(x)} north, ${metres(y)} east`;
    const element = this.markers[number].getElement();
    element?.setAttribute("aria-label", words);
    element?.setAttribute("role", "button");
    element?.setAttribute("aria-roledescription", "vessel that can be moved");
  }
  vessel(number) {
    const icon = L.divIcon({ className: "vessel", html: make("span", {}, "★", make("b", {}, `ASV${number}`)), iconSize: [28, 28] });
    const marker = L.marker([0, 0], { icon, draggable: true, pmIgnore: true, autoPanOnFocus: false, zIndexOffset: 1000 }).addTo(this.map);
    marker.on("dragstart", () => { this.dragging = true; });
    marker.on("drag", () => this.move(number, place(marker.getLatLng())));
    marker.on("dragend", () => { this.dragging = false; this.keep(this.stations); });
    marker.getElement().addEventListener("keydown", (event) => {
      const moved = this.moved(event, this.stations[number]);
      if (moved) {
        marker.setLatLng(at(moved));
        this.move(number, moved);
        clearTimeout(this.resting);
        this.resting = setTimeout(() => this.keep(this.stations), REST);
      } else if ((event.key === "Delete" || event.key === "Backspace") && this.stations.length > 1) {
        this.keep(this.stations.filter((_, other) => other !== number));
        this.markers[0].getElement().focus();
      }
    });
    return marker;
  }
  move(number, station) {
    this.stations[number] = station;
    this.rings[number].forEach((ring) => ring.setLatLng(at(station)));
    this.name(number);
    this.tellPlace(station);
    this.tellStations();
    this.try();
  }
  // What is predicted meanwhile, with vessels elsewhere or with other keys: one question at a time, and the newest next.
  try(more = { stations: this.stations }) {
    if (this.trying) { this.waiting = more; return; }
    this.trying = true;
    this.asked = performance.now();
    this.bench.ask("try", { id: ++this.id, ...more });
  }
  tried(told) {
    if (told.id !== this.id) return;
    (bindusbl.drags ??= []).push(performance.now() - this.asked);
    this.trying = false;
    if (told.worst) {
      this.tell(told, this.bench.forecast ?? {});
      this.showShadows(told.shadows);
      if (!this.dragging) { Object.assign(this.chart, { reach: told.reach }); this.stations = told.stations; this.showVessels(); }
    } else byId("worst").textContent = `Nothing is predicted: ${told.refusal}`;
    const { waiting } = this;
    this.waiting = null;
    if (waiting) this.try(waiting);
  }
  keep(stations) {
    this.trying = false;
    this.waiting = null;
    this.bench.ask("vessels", { stations });
  }
  seeAll() {
    if (!this.chart.outline.length) return;
    const bounds = L.latLngBounds([...this.chart.outline, ...this.chart.ways.flat(), ...this.stations].map(at));
    this.map.fitBounds(bounds.pad(0.08), { animate: false });
    this.fitted = true; // until one moves it, the chart follows the window
  }
  // Lines of north and east at a round step, with their names at the left and lower edge.
  graticule() {
    const bounds = this.map.getBounds(), scale = this.map.options.crs.scale(this.map.getZoom()), step = roundStep(90 / scale);
    this.layers.grid.clearLayers();
    const line = (one, other, name, anchor) => {
      L.polyline([one, other], { className: "graticule", interactive: false, pane: "grid", pmIgnore: true }).addTo(this.layers.grid);
      L.marker(one, { icon: L.divIcon({ className: "graticule-name", html: make("span", {}, name), iconSize: [0, 0], iconAnchor: anchor }), interactive: false, keyboard: false, pane: "grid", pmIgnore: true }).addTo(this.layers.grid);
    };
    const south = bounds.getSouth(), north = bounds.getNorth(), west = bounds.getWest(), east = bounds.getEast();
    for (let x = Math.ceil(south / step) * step; x <= north; x += step) line(L.latLng(x, west), L.latLng(x, east), `${+x.toPrecision(8)} m N`, [-4, 16]);
    for (let y = Math.ceil(west / step) * step; y <= east; y += step) line(L.latLng(north, y), L.latLng(south, y), `${+y.toPrecision(8)} m E`, [-4, -2]);
  }
  tellPlace([x, y]) {
    byId("cursor").textContent = `${x.toFixed(1)} m north, ${y.toFixed(1)} m east`;
  }
  // The place where the predicted error is largest, of those the one that is farthest from vessels.
  neediest() {
    const { shade } = this.told ?? {};
    if (!shade) return this.chart.centre ?? place(this.map.getCenter());
    const [south, west, north, east] = shade.box, rows = shade.across, columns = shade.values.length / rows;
    const bad = (value) => (shade.kind === "chance" ? -value : value);
    const found = shade.values.map((value, i) => ({ value, spot: [south + (i % rows + 0.5) * (north - south) / rows, west + (Math.floor(i / rows) + 0.5) * (east - west) / columns] })).filter(({ value }) => value !== null);
    const away = ([x, y]) => Math.min(...this.stations.map(([a, b]) => Math.hypot(x - a, y - b)));
    found.sort((a, b) => bad(b.value) - bad(a.value) || away(b.spot) - away(a.spot));
    return found[0]?.spot ?? place(this.map.getCenter());
  }
  // What is predicted: the worst AUV in words, each AUV in a table, the map's shades.
  tell(found, { refusal = "", left_out = [] }) {
    this.told = found;
    byId("worst").classList.remove("stale");
    byId("left-out").textContent = left_out.join(" ");
    byId("auvs").hidden = !found;
    this.shadeBy(found?.shade, found?.goal?.top);
    if (!found) { byId("worst").textContent = `Nothing is predicted: ${refusal}`; return; }
    const { worst, chance } = found, per = (share) => `${significant(100 * share)} %`;
    byId("worst").textContent = `Worst AUV of a mission, predicted: ${significant(worst.position_error_m)} m on average, below ${significant(worst.position_error_p95_m)} m 95 % of the time`
      + (chance ? `; a ping makes a fix with ${per(chance[0])} (${per(chance[1])} where it is least likely).` : ".");
    const head = COLUMNS.map(([, words, unit]) => make("th", { scope: "col" }, words, make("span", { class: "unit" }, unit)));
    const cells = (values) => COLUMNS.map(([name, , , factor]) => make("td", {}, Number.isFinite(values[name]) ? significant(values[name] * factor) : "–"));
    const rows = found.auvs.map((auv, i) => make("tr", {}, make("th", { scope: "row", style: `color:var(--c${i % 8})` }, `AUV${i}`), ...cells(auv)));
    byId("auvs").replaceChildren(make("table", {}, make("thead", {}, make("tr", {}, make("th", {}, "AUV"), ...head)), make("tbody", {}, ...rows, make("tr", {}, make("th", { scope: "row" }, "worst"), ...cells(worst)))));
  }
  shadeBy(shade, goal) {
    if (!shade) { this.image?.remove(); this.image = null; byId("scale").replaceChildren(); return; }
    const isChance = shade.kind === "chance", known = shade.values.filter((value) => value !== null);
    const kind = `${shade.kind} ${goal}`;
    if (this.kind !== kind) { this.kind = kind; this.top = isChance ? 1 : goal || roundStep(quantile(known, 0.9) || 1); } // kept, so that shades can be compared
    const rows = shade.across, columns = shade.values.length / rows, canvas = document.createElement("canvas"), [south, west, north, east] = shade.box;
    Object.assign(canvas, { width: columns, height: rows });
    const image = new ImageData(columns, rows);
    shade.values.forEach((value, i) => {
      if (value === null) return;
      image.data.set([...shadeOf(clamp(value / this.top, 0, 1), !isChance), 165], 4 * ((rows - 1 - i % rows) * columns + Math.floor(i / rows)));
    });
    canvas.getContext("2d").putImageData(image, 0, 0);
    const bounds = L.latLngBounds([south, west], [north, east]), address = this.cut(canvas, shade.box).toDataURL();
    if (this.image) this.image.setUrl(address).setBounds(bounds);
    else this.image = L.imageOverlay(address, bounds, { pane: "shade", interactive: false }).addTo(this.map);
    const ends = isChance ? ["0 %", "100 %"] : ["0 m", `${significant(this.top)} m${goal ? ", the goal," : ""} or more`];
    byId("scale").replaceChildren(ramp(...ends, !isChance));
  }
  // Cells at the edge end with the survey.
  cut(cells, [south, west, north, east]) {
    const canvas = document.createElement("canvas"), context = canvas.getContext("2d"), fine = Math.ceil(480 / Math.max(cells.width, cells.height));
    Object.assign(canvas, { width: cells.width * fine, height: cells.height * fine });
    polygon(context, this.chart.outline.map(([x, y]) => [(y - west) / (east - west) * canvas.width, (north - x) / (north - south) * canvas.height]));
    context.clip();
    context.imageSmoothingEnabled = false;
    context.drawImage(cells, 0, 0, canvas.width, canvas.height);
    return canvas;
  }
  tellFacts({ area, duration, placement, vessels, route, origin, ways, reach }) {
    const rows = { area, duration, "HF, MF reach": `${metres(reach.hf)}, ${metres(reach.mf)} seen from above`, AUVs: `${ways.length}, ${route}`, "x = y = 0": origin ? `${origin.map((it) => it.toFixed(6)).join(", ")}` : "nowhere on Earth" };
    byId("facts").replaceChildren(...Object.entries(rows).flatMap(([name, words]) => [make("dt", {}, name), make("dd", {}, words)]));
    byId("placement").replaceChildren(`${vessels} vessel${vessels === 1 ? "" : "s"}, ${placement}. `, this.stations.length ? "Drag one on the chart, or write its place." : "They move: they are told where to go during the mission.");
  }
  tellStations() {
    const host = byId("stations");
    if (host.querySelectorAll("tbody tr").length !== this.stations.length) {
      const rows = this.stations.map((_, number) => {
        const cells = [0, 1].map((axis) => {
          const input = make("input", { type: "number", step: "any", "aria-label": `ASV${number}, ${axis ? "east" : "north"}, m` });
          input.addEventListener("change", () => {
            if (!Number.isFinite(input.valueAsNumber)) return;
            const stations = this.stations.map((it) => [...it]);
            stations[number][axis] = input.valueAsNumber;
            this.keep(stations);
          });
          return make("td", {}, input);
        });
        const remove = make("button", { type: "button", "aria-label": `Remove ASV${number}` }, "remove");
        remove.addEventListener("click", () => this.keep(this.stations.filter((__, other) => other !== number)));
        return make("tr", {}, make("th", { scope: "row" }, `ASV${number}`), ...cells, make("td", {}, remove));
      });
      const heads = [["vessel", ""], ["north", "m"], ["east", "m"], ["", ""]].map(([words, unit]) => make("th", { scope: "col" }, words, make("span", { class: "unit" }, unit)));
      host.replaceChildren(make("table", {}, make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows)));
    }
    const inputs = [...host.querySelectorAll("input")];
    this.stations.flat().forEach((value, i) => { if (document.activeElement !== inputs[i]) inputs[i].value = +value.toFixed(2); });
    host.querySelectorAll("button").forEach((button) => { button.disabled = this.stations.length < 2; });
  }
}
