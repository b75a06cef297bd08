"""Fly a scenario twice, in the simulator and in the second implementation, and compare events."""

import math

from second import Drawn, Second

from bindusbl_des import Scenario, simulate

Tables = dict[str, list[dict]]
KEPT = {  # columns that are compared as they are
    "rounds": "round started_at_s colours conflicts uplink_s downlink_s fixes",
    "pings": "auv asv round slot sent_at_s x_m y_m in_range_of heard_by waited_s "
    "called_at_s called_by call",
    "receptions": "auv asv arrived_at_s outcome",
    "broadcasts": "round asv sent_at_s airtime_s payload_bytes fixes part",
    "frame_receptions": "auv arrived_at_s outcome",
    "fixes": "auv round asvs pinged_at_s broadcast_at_s broadcast_by delivered_at_s outcome",
}


def value(it: object) -> object:
    """Return a table's value: None where it has none, the number of a vehicle for its name."""
    if it is None or (isinstance(it, float) and math.isnan(it)):
        return None
    return int(it[3:]) if isinstance(it, str) and it[:3] in ("AUV", "ASV") and " " not in it else it


def tables_of(result) -> Tables:
    """Return the simulator's events."""
    read = {
        name: [
            {key: value(it) for key, it in row.items()}
            for row in result.tables[name].to_dict("records")
        ]
        for name in KEPT
    }
    tables = {
        name: [{key: row[key] for key in KEPT[name].split()} for row in rows]
        for name, rows in read.items()
    }
    sent = {row["ping"]: row["sent_at_s"] for row in read["pings"]}
    for row, kept in zip(read["receptions"], tables["receptions"], strict=True):
        kept["sent_at_s"] = sent[row["ping"]]
    for row, kept in zip(read["frame_receptions"], tables["frame_receptions"], strict=True):
        frame = read["broadcasts"][row["broadcast"]]
        kept |= {"sent_at_s": frame["sent_at_s"], "asv": frame["asv"]}
    for row in tables["fixes"]:
        asvs = [row["asvs"]] if isinstance(row["asvs"], int) else map(value, row["asvs"].split())
        row["asvs"] = sorted(asvs)
    return tables


def tables_of_second(mission: Second) -> Tables:
    """Return the second implementation's events, in the same form."""
    return {
        "rounds": mission.rounds,
        "pings": [
            {
                "auv": p.auv,
                "asv": p.asv,
                "round": p.round,
                "slot": p.slot,
                "sent_at_s": p.sent,
                "x_m": p.place[0],
                "y_m": p.place[1],
                "in_range_of": len(p.in_range),
                "heard_by": sum(mission.outcome(p, at) == "heard" for at in mission.listeners(p)),
                "called_at_s": p.called,
                "called_by": p.caller,
                "call": p.call,
                "waited_s": p.waited,
            }
            for p in mission.pings
        ],
        "receptions": [
            {
                "sent_at_s": p.sent,
                "auv": at if p.auv is None else p.auv,
                "asv": at if p.asv is None else p.asv,
                "arrived_at_s": p.arrivals.get(at),
                "outcome": mission.outcome(p, at),
            }
            for p in mission.pings
            for at in mission.listeners(p)
        ],
        "broadcasts": [frame.row for frame in mission.frames],
        "frame_receptions": [
            {
                "sent_at_s": frame.row["sent_at_s"],
                "asv": frame.row["asv"],
                "auv": i,
                "arrived_at_s": frame.at[i][0] if frame.at[i][0] < mission.end else None,
                "outcome": mission.reception(frame, i),
            }
            for frame in mission.frames
            for i in mission.auvs
        ],
        "fixes": [
            {
                "auv": f.auv,
                "round": f.ping.round,
                "asvs": f.asvs,
                "pinged_at_s": f.ping.sent,
                "broadcast_at_s": f.sent,
                "broadcast_by": f.by,
                "delivered_at_s": f.delivered,
                "outcome": f.outcome,
            }
            for f in mission.fixes
        ],
    }


def order(row: dict) -> tuple:
    """Order rows by instants (to 0.1 us) and vehicles."""
    keys = ("round", "sent_at_s", "pinged_at_s", "auv", "asv")
    found = [row[key] for key in keys if key in row]
    return tuple(
        round(it, 7) if isinstance(it, float) else -1 if it is None else it for it in found
    )


def alike(ours: object, theirs: object) -> bool:
    """Compare instants to 1e-9 s and all else exactly."""
    if isinstance(ours, float) and isinstance(theirs, (int, float)):
        return abs(ours - theirs) < 1e-9
    return ours == theirs


def disagreements(keys: dict, seed: int = 1) -> tuple[list[str], dict[str, int]]:
    """Return what differs, a line for each table's first difference, and how many rows agreed."""
    theirs = tables_of(simulate(Scenario.model_validate(keys), seed=seed))
    drawn = Drawn(
        turns=[row["auv"] for row in theirs["pings"]],
        pings=[
            (row["auv"], row["sent_at_s"] - (row["waited_s"] or 0.0), row["sent_at_s"])
            for row in theirs["pings"]
        ],
        broadcasters=[row["asv"] for row in theirs["broadcasts"]],
    )
    mission = Second(keys, drawn)
    mission.fly()
    ours = tables_of_second(mission)
    found = []
    for name, rows in theirs.items():
        mine, rows = sorted(ours[name], key=order), sorted(rows, key=order)
        for a, b in zip(mine, rows, strict=False):
            wrong = [k for k in b if not alike(a.get(k), b[k])]
            if wrong:
                found.append(f"{name}: {', '.join(wrong)}: second {a}, simulator {b}")
                break
        else:
            if len(mine) != len(rows):
                extra = max(mine, rows, key=len)[min(len(mine), len(rows))]
                found.append(f"{name}: second has {len(mine)} rows, simulator {len(rows)}: {extra}")
    return found, {name: len(rows) for name, rows in theirs.items()}
