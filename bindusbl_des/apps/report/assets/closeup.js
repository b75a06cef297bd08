"use strict";
// The surroundings of one AUV, a few metres wide: where it is, where it believes to be, its last fix.

class Closeup {
  constructor(canvas, mission, hidden) {
    this.map = new SeaMap(canvas, mission, { still: true, hidden });
    this.map.home = () => {};
    this.map.view = { x: 0, y: 0, scale: 1 };
    this.map.draw = (context, width, height) => this.draw(context, width, height);
    this.map.sheet.draw = this.map.draw;
    this.mission = mission;
    this.auv = 0;
    this.now = 0;
  }
  paint(now, playing) { this.now = now; this.map.sheet.show(playing); }
  draw(context, width, height) {
    const { map, mission } = this, state = mission.auvAt(this.auv, this.now);
    Object.assign(map, { width, height });
    const shown = Math.max(state.error, map.hidden.has("sure") ? 0 : SURE * Math.sqrt(Math.max(state.spread[0], state.spread[1])) || 0);
    const reach = [2, 5, 10, 20, 50, 100, 200, 500, 1000].find((it) => it > 1.15 * shown) || 2000;
    map.view = { x: state.x, y: state.y, scale: Math.min(width, height) / (2.2 * reach) };
    this.drawScale(context, reach, width, height);
    const colour = seriesColour(this.auv);
    this.trail(context, colour);
    if (state.fix !== null) this.fix(context, state, colour);
    if (!map.hidden.has("sure")) map.sure(context, state, colour);
    map.ring(context, state.estimateX, state.estimateY, state.envelope, colour, { dash: [6, 4], alpha: 0.6 });
    const [px, py] = map.at(state.x, state.y), [ex, ey] = map.at(state.estimateX, state.estimateY);
    map.stroke(context, colour, px, py, ex, ey, 1.5);
    map.hull(context, px, py, state.yaw, colour);
    map.plus(context, ex, ey, 7, colour, 2.5);
    this.named = [];
    this.name(context, "truth", px, py, colour);
    this.name(context, "estimate", ex, ey, colour);
    if (state.fix !== null) this.name(context, "last fix", ...map.at(mission.fixes.x[state.fix], mission.fixes.y[state.fix]), colours.ink);
    this.width = 2 * reach;
  }
  // The name of a place beside it, where it covers no other name.
  name(context, words, px, py, colour) {
    context.font = "600 12px system-ui, sans-serif";
    const wide = context.measureText(words).width, rows = [18, -10, 34, -26, 50];
    const [left, base] = rows.flatMap((row) => [[px + 9, py + row], [px - 9 - wide, py + row]])
      .find(([x, y]) => this.named.every(([from, to, other]) => x > to + 3 || x + wide < from - 3 || Math.abs(y - other) > 13));
    this.named.push([left, left + wide, base]);
    this.map.label(context, words, left, base, colour);
  }
  drawScale(context, reach, width, height) {
    const { map } = this;
    for (const share of [0.5, 1]) map.ring(context, map.view.x, map.view.y, share * reach, colours.line);
    context.fillStyle = colours.soft;
    context.font = "11px system-ui, sans-serif";
    context.fillText(`rings ${reach / 2} m and ${reach} m around the truth`, 8, height - 7);
    map.drawNorth(context);
  }
  // The last seconds of truth (broad) and estimate (fine).
  trail(context, colour) {
    const { map, mission } = this, auv = mission.auvs[this.auv];
    const end = above(mission.time, this.now), start = Math.max(0, end - Math.round(60 * mission.rate));
    const xs = auv.x.subarray(start, end), ys = auv.y.subarray(start, end);
    map.line(context, xs, ys, { colour, width: 5, alpha: 0.2 });
    map.line(context, xs.map((x, i) => x + auv.off_x[start + i]), ys.map((y, i) => y + auv.off_y[start + i]), { colour, width: 1, alpha: 0.8 });
  }
  // The last fix is of where the AUV was when it pinged: its mark stays behind, with its 3-sigma ellipse.
  fix(context, state, colour) {
    const { map } = this, fixes = this.mission.fixes, row = state.fix;
    const spread = [fixes.sd_x[row] ** 2, fixes.sd_y[row] ** 2, fixes.cov[row]];
    map.ellipse(context, fixes.x[row], fixes.y[row], spread, 3, colours.mf, { fill: 0.25 });
    map.cross(context, fixes.x[row], fixes.y[row], colours.mf, 1);
    if (state.jumpFrom && state.sinceFix < 1) {
      const [jx, jy] = map.at(...state.jumpFrom), [ex, ey] = map.at(state.estimateX, state.estimateY);
      map.stroke(context, colours.mf, jx, jy, ex, ey, 2.5, [4, 3]);
    }
  }
}
