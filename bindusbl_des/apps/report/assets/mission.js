"use strict";
// A run's data with what is asked of it at any instant.

class Mission {
  constructor(run) {
    Object.assign(this, run);
    bindusbl.long ||= this.duration >= LONG;
    this.rate = this.time.length > 1 ? 1 / (this.time[1] - this.time[0]) : 1;
    this.delivered = this.auvs.map((_, auv) => this.rowsOf(auv));
    this.landed = this.delivered.map((rows) => Float64Array.from(rows, (row) => this.fixes.delivered[row]));
    this.longestArrival = 2 * this.hf.range / this.soundSpeed;
    this.receptionsOf = Array.from({ length: this.pings.at.length }, () => []);
    this.receptions.ping.forEach((ping, row) => this.receptionsOf[ping].push(row));
    this.asvsRest = this.asvs.every(({ x, y }) => x.every((it) => it === x[0]) && y.every((it) => it === y[0]));
    this.deliveredOrder = this.inTime(this.delivered.flat());
    this.deliveredTimes = Float64Array.from(this.deliveredOrder, (row) => this.fixes.delivered[row]);
    this.decided = Float64Array.from(this.pings.at, (_, ping) => this.decidedAt(ping));
    this.lost = Array.from(this.decided.keys()).filter((ping) => this.isLost(ping));
  }
  rowsOf(auv) {
    const { fixes } = this;
    return this.inTime([...fixes.auv.keys()].filter((row) => fixes.auv[row] === auv && fixes.outcome[row] === 0));
  }
  inTime(rows) { return rows.sort((a, b) => this.fixes.delivered[a] - this.fixes.delivered[b]); }
  isLost(ping) {
    const fate = this.fates[this.pings.fate[ping]];
    return fate !== "delivered" && fate !== "in_flight";
  }
  // When it is known what became of a ping: not before its sound, or its fix, has passed everybody.
  decidedAt(ping) {
    const { pings, receptions, fixes, broadcasts } = this, fate = this.fates[pings.fate[ping]];
    if (!this.isSent(ping)) return pings.called[ping] + 2 * this.hf.range / this.soundSpeed;
    if (fate === "out_of_hf") return pings.at[ping] + this.hf.range / this.soundSpeed;
    if (fate === "lost" || fate === "collided") return Math.max(...this.receptionsOf[ping].map((row) => receptions.at[row])) + this.pingLength;
    this.fixOf ??= new Map(Array.from(fixes.ping, (id, row) => [this.keyOf(id, fixes.auv[row]), row]));
    const fix = this.fixOf.get(this.keyOf(pings.id[ping], pings.auv[ping]));
    if (fate === "delivered") return fixes.delivered[fix];
    if (fate !== "out_of_mf") return NaN;
    const airtime = broadcasts.airtime[above(broadcasts.at, fixes.broadcast[fix] + 1e-6) - 1];
    return fixes.broadcast[fix] + airtime + this.mf.range / this.soundSpeed;
  }
  // With passive ranging a ping of an ASV stands there once for each AUV.
  keyOf(id, auv) { return id * this.auvs.length + auv; }
  isFirst(ping) { return !this.asvsPing || ping === 0 || this.pings.id[ping] !== this.pings.id[ping - 1]; }
  // With calls (twtt, polling) a turn whose call got no answer has no ping.
  isSent(ping) { return !this.calls || this.pings.answered[ping] === 1; }
  colourOf(ping) { return this.asvsPing ? colours.hf : seriesColour(this.pings.auv[ping]); }
  // The lanes of who sends a ping, and of who hears it; AUVs come first.
  laneOf(ping) { return this.asvsPing ? this.auvs.length + this.pings.asv[ping] : this.pings.auv[ping]; }
  hearingLane(row) { return this.asvsPing ? this.pings.auv[this.receptions.ping[row]] : this.auvs.length + this.receptions.asv[row]; }
  hearerAt(row) {
    const { receptions, pings } = this, at = receptions.at[row];
    return this.asvsPing ? this.auvAt(pings.auv[receptions.ping[row]], at) : this.asvAt(receptions.asv[row], at);
  }
  // The sample at or before t, and the share of the way to the next one.
  place(t) {
    const last = this.time.length - 1;
    const at = clamp(t * this.rate, 0, last);
    const k = Math.min(Math.floor(at), Math.max(last - 1, 0));
    return [k, last ? at - k : 0, Math.min(k + 1, last)];
  }
  along(column, t) {
    const [k, share, next] = this.place(t);
    return column[k] + share * (column[next] - column[k]);
  }
  // Truth and belief of an AUV; what fixes change jumps at the instant of their delivery.
  auvAt(number, t) {
    const auv = this.auvs[number];
    const [k, share, next] = this.place(t);
    const count = above(this.landed[number], t);
    const fixes = this.landed[number];
    const from = this.time[k], to = this.time[next];
    const jumpsBefore = count > 0 && fixes[count - 1] > from;
    const jumpsAfter = count < fixes.length && fixes[count] <= to;
    const off = (column) => {
      if (jumpsBefore) return column[next];
      if (jumpsAfter) return column[k];
      return column[k] + share * (column[next] - column[k]);
    };
    const x = this.along(auv.x, t), y = this.along(auv.y, t);
    const ex = off(auv.off_x), ey = off(auv.off_y);
    return {
      x, y, yaw: auv.yaw[k], estimateX: x + ex, estimateY: y + ey, error: Math.hypot(ex, ey),
      imuX: x + this.along(auv.drift_x, t), imuY: y + this.along(auv.drift_y, t),
      envelope: off(auv.envelope), spread: this.spreadAt(auv, off),
      fix: count ? this.delivered[number][count - 1] : null,
      sinceFix: t - (count ? fixes[count - 1] : 0), fixes: count,
      jumpFrom: jumpsBefore ? [x + auv.off_x[k], y + auv.off_y[k]] : null,
    };
  }
  // How sure an AUV is of its estimate: variances xx, yy and covariance xy (m2).
  spreadAt(auv, off) {
    const x = off(auv.sd_x), y = off(auv.sd_y);
    return [x * x, y * y, off(auv.together) * x * y];
  }
  hasFailed(number, t) {
    return this.asvs[number].failures.some(([begin, end]) => begin <= t && (end === null || t < end));
  }
  asvAt(number, t) {
    const asv = this.asvs[number];
    return { x: this.along(asv.x, t), y: this.along(asv.y, t) };
  }
}
