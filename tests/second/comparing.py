"""Fly a scenario twice, in the simulator and in the second implementation, and compare events."""

from medium import Row
from second import Second

from bindusbl_des import Scenario, simulate

Tables = dict[str, list[dict]]
KEPT = {  # columns that are compared
    "rounds": "round started_at_s colours conflicts uplink_s downlink_s fixes",
    "pings": "auv asv round slot sent_at_s x_m y_m in_range_of heard_by waited_s "
    "called_at_s called_by call",
    "receptions": "sent_at_s auv asv arrived_at_s outcome",
    "broadcasts": "round asv sent_at_s airtime_s payload_bytes fixes part",
    "frame_receptions": "sent_at_s asv auv arrived_at_s outcome",
    "auv_frames": "kind auv hops sent_at_s airtime_s fixes",
    "signals": "kind sender to sent_at_s lasts_s size_bytes",
    "signal_receptions": "sent_at_s sender listener arrived_at_s outcome",
    "fixes": "auv round asvs pinged_at_s broadcast_at_s broadcast_by delivered_at_s outcome "
    "hops repeats duplicates acknowledged_at_s",
}


def tables_of(result) -> Tables:
    """Return the simulator's events, None where there is no value."""
    tables = {
        name: [
            {key: None if it != it else it for key, it in row.items()}
            for row in result.tables[name].to_dict("records")
        ]
        for name in KEPT
        if name in result.tables
    }
    sent = {row["ping"]: row["sent_at_s"] for row in tables["pings"]}
    for row in tables["receptions"]:
        row["sent_at_s"] = sent[row["ping"]]
    for row in tables.get("signal_receptions", []):  # pings among them
        name = "pings" if row["signal"] is None else "signals"
        sound = tables[name][int(row[name[:-1]])]
        sender = sound["auv"] if name == "pings" else sound["sender"]
        row |= {"sent_at_s": sound["sent_at_s"], "sender": sender}
    for row in tables["frame_receptions"]:
        frame = tables["broadcasts"][row["broadcast"]]
        row |= {"sent_at_s": frame["sent_at_s"], "asv": frame["asv"]}
    return tables


def tables_of_second(mission: Second) -> Tables:
    """Return the second implementation's events, in the same form."""
    pings, receptions, frame_receptions = [], [], []
    for ping in mission.pings:
        outcomes = {at: mission.outcome(ping, at) for at in ping.at}
        for at, outcome in outcomes.items():
            arrived = ping.at[at][0] if ping.in_vain is None else None
            row = vars(ping) | {"arrived_at_s": arrived, "outcome": outcome}
            receptions.append(row | {at[:3].lower(): at})
        heard = list(outcomes.values()).count("heard")
        pings.append(vars(ping) | {"in_range_of": len(ping.in_range), "heard_by": heard})
    for frame in mission.frames:
        for i in () if mission.instant else mission.auvs:
            arrived = frame.at[i][0] if frame.at[i][0] < mission.end else None
            row = {"auv": i, "arrived_at_s": arrived, "outcome": mission.outcome(frame, i)}
            frame_receptions.append(vars(frame) | row)
    senses = []
    for sound in mission.sensed:
        for i in sound.in_range:
            arrived = sound.at[i][0] if sound.at[i][0] < mission.end else None
            row = {"listener": i, "arrived_at_s": arrived, "outcome": mission.outcome(sound, i)}
            senses.append(vars(sound) | row)
    return {
        "rounds": [vars(row) for row in mission.rounds],
        "pings": pings,
        "receptions": receptions,
        "broadcasts": [vars(frame) for frame in mission.frames],
        "frame_receptions": frame_receptions,
        "auv_frames": [vars(frame) for frame in mission.auv_frames],
        "signals": [vars(sound) for sound in mission.signals],
        "signal_receptions": senses,
        "fixes": [vars(fix) | {"round": fix.ping.round} for fix in mission.fixes],
    }


def order(row: dict) -> tuple:
    """Order rows by instants (to 0.1 us) and vehicles."""
    keys = ("round", "sent_at_s", "pinged_at_s", "auv", "asv", "sender", "listener")
    found = [row[key] for key in keys if key in row]
    return tuple(round(it, 7) if isinstance(it, float) else str(it).zfill(9) for it in found)


def alike(ours: object, theirs: object) -> bool:
    """Compare instants to 0.1 us, places to 0.1 um and all else exactly."""
    if isinstance(ours, float) and isinstance(theirs, (int, float)):
        return abs(ours - theirs) < 1e-7
    return ours == theirs


def given(tables: Tables, packets: list[tuple[str, float]]) -> Row:
    """Return what a mission drew and measured, by its tables.

    That is the turns and broadcasters of parts called `random`, who pinged, since when it wanted to
    and when, and where an AUV was measured when (to 1 us), with the horizontal variance.
    """
    return Row(
        packets=packets,
        turns=[row["auv"] for row in tables["pings"]],
        pings=[
            (row["auv"], row["sent_at_s"] - (row["waited_s"] or 0.0), row["sent_at_s"])
            for row in tables["pings"]
        ],
        broadcasters=[row["asv"] for row in tables["broadcasts"]],
        measured={
            (row["auv"], round(row["pinged_at_s"], 6)): (
                *(row["x_m"], row["y_m"], row["z_m"]),
                row["sd_x_m"] ** 2 + row["sd_y_m"] ** 2,
            )
            for row in tables["fixes"]
        },
    )


def packets_of(keys: dict, seed: int) -> list[tuple[str, float]]:
    """Return when AUVs have something to send: when they ping with pings that take no time."""
    if "access" not in keys["protocol"]:
        return []
    brief = {**keys, "acoustics": {**keys["acoustics"]}, "protocol": {**keys["protocol"]}}
    brief["acoustics"]["hf"] = {**keys["acoustics"]["hf"], "ping_s": 1e-6}
    brief["protocol"]["access"] = "aloha"
    pings = simulate(Scenario.model_validate(brief), seed=seed).tables["pings"]
    return list(zip(pings.auv, pings.sent_at_s, strict=True))


def disagreements(keys: dict, seed: int = 1) -> tuple[list[str], dict[str, int]]:
    """Return what differs, a line for each table's first difference, and how many rows agreed."""
    theirs = tables_of(simulate(Scenario.model_validate(keys), seed=seed))
    mission = Second(keys, given(theirs, packets_of(keys, seed)))
    mission.fly()
    ours = tables_of_second(mission)
    found = []
    for name, columns in KEPT.items():
        mine, rows = (
            sorted(({key: row.get(key) for key in columns.split()} for row in table), key=order)
            for table in (ours[name], theirs.get(name, []))
        )
        told = theirs[name][0] if theirs.get(name) else columns.split()
        for a, b in zip(mine, rows, strict=False):
            wrong = [k for k in b if k in told and not alike(a[k], b[k])]
            if wrong:
                found.append(f"{name}: {', '.join(wrong)}: second {a}, simulator {b}")
                break
        else:
            if len(mine) != len(rows):
                extra = max(mine, rows, key=len)[min(len(mine), len(rows))]
                found.append(f"{name}: second has {len(mine)} rows, simulator {len(rows)}: {extra}")
    return found, {name: len(rows) for name, rows in theirs.items()}
