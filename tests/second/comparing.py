"""Fly a scenario twice, in the simulator and in the second implementation, and compare events."""

import math

from second import Drawn, Second

from bindusbl_des import Scenario, simulate


def number(name: object) -> int | None:
    """Return the number of a vehicle."""
    return int(name[4:] if name[:4] == "AUV " else name[3:]) if isinstance(name, str) else None


def value(it: object) -> object:
    """Return a table's value, None where it has none."""
    return None if it is None or (isinstance(it, float) and math.isnan(it)) else it


def alike(ours: object, theirs: object) -> bool:
    """Compare instants to 1e-9 s and all else exactly."""
    if isinstance(ours, float) and isinstance(theirs, (int, float)):
        return abs(ours - theirs) < 1e-9
    return ours == theirs


def tables_of(result) -> dict[str, list[dict]]:
    """Return the simulator's events."""
    found = {
        name: [
            {k: value(v) for k, v in row.items()} for row in result.tables[name].to_dict("records")
        ]
        for name in ("rounds", "pings", "receptions", "broadcasts", "frame_receptions", "fixes")
    }
    pings = {row["ping"]: row for row in found["pings"]}
    out = {name: [] for name in found}
    keys = {}
    for row in found["pings"]:
        keys[row["ping"]] = (round(row["sent_at_s"], 8), number(row["auv"]))
        out["pings"].append(
            {
                "sent": row["sent_at_s"],
                "auv": number(row["auv"]),
                "round": row["round"],
                "slot": row["slot"],
                "in_range": row["in_range_of"],
                "heard": row["heard_by"],
                "x": row["x_m"],
                "y": row["y_m"],
                "called": row["called_at_s"],
                "caller": number(row["called_by"]),
                "call": row["call"],
            }
        )
    for row in found["receptions"]:
        out["receptions"].append(
            {
                "sent": pings[row["ping"]]["sent_at_s"],
                "auv": number(row["auv"]),
                "asv": number(row["asv"]),
                "arrived": row["arrived_at_s"],
                "outcome": row["outcome"],
            }
        )
    for row in found["rounds"]:
        out["rounds"].append(
            {
                k: row[k]
                for k in (
                    "round",
                    "started_at_s",
                    "colours",
                    "conflicts",
                    "uplink_s",
                    "downlink_s",
                    "fixes",
                )
            }
        )
    for row in found["broadcasts"]:
        out["broadcasts"].append(
            {"sent_at_s": row["sent_at_s"], "asv": number(row["asv"])}
            | {k: row[k] for k in ("round", "airtime_s", "payload_bytes", "fixes", "part")}
        )
    for row in found["frame_receptions"]:
        sent = found["broadcasts"][row["broadcast"]]
        out["frame_receptions"].append(
            {
                "sent": sent["sent_at_s"],
                "asv": number(sent["asv"]),
                "auv": number(row["auv"]),
                "arrived": row["arrived_at_s"],
                "outcome": row["outcome"],
            }
        )
    for row in found["fixes"]:
        out["fixes"].append(
            {
                "pinged": row["pinged_at_s"],
                "auv": number(row["auv"]),
                "round": row["round"],
                "asvs": sorted(map(number, row["asvs"].split())),
                "broadcast": row["broadcast_at_s"],
                "by": number(row["broadcast_by"]),
                "delivered": row["delivered_at_s"],
                "outcome": row["outcome"],
            }
        )
    return out


def tables_of_second(mission: Second) -> dict[str, list[dict]]:
    """Return the second implementation's events, in the same form."""
    out: dict[str, list[dict]] = {"rounds": mission.rounds, "broadcasts": mission.broadcasts}
    out["pings"], out["receptions"] = [], []
    for p in mission.pings:
        x, y, _ = mission.where(p.auv, p.sent)
        heard = sum(it == "heard" for it in p.outcomes.values())
        out["pings"].append(
            {
                "sent": p.sent,
                "auv": p.auv,
                "round": p.round,
                "slot": p.slot,
                "x": x,
                "y": y,
                "in_range": len(p.in_range),
                "heard": heard,
                "called": p.called,
                "caller": p.caller,
                "call": p.call,
            }
        )
        for j in mission.all_asvs:
            out["receptions"].append(
                {
                    "sent": p.sent,
                    "auv": p.auv,
                    "asv": j,
                    "arrived": p.arrivals.get(j),
                    "outcome": p.outcomes[j],
                }
            )
    out["frame_receptions"] = [
        {
            "sent": mission.frames[row["broadcast"]]["row"]["sent_at_s"],
            "asv": mission.frames[row["broadcast"]]["row"]["asv"],
            "auv": row["auv"],
            "arrived": row["arrived_at_s"],
            "outcome": row["outcome"],
        }
        for row in mission.listen()
    ]
    out["fixes"] = [
        {
            "pinged": f.ping.sent,
            "auv": f.ping.auv,
            "round": f.ping.round,
            "asvs": f.asvs,
            "broadcast": f.sent,
            "by": f.by,
            "delivered": f.delivered,
            "outcome": f.outcome,
        }
        for f in mission.fixes
    ]
    return out


def order(row: dict) -> tuple:
    """Order rows by instants (to 0.1 us) and vehicles."""
    return tuple(
        round(row[k], 7)
        if isinstance(row.get(k), float)
        else (-1 if row.get(k) is None else row[k])
        for k in ("round", "sent", "sent_at_s", "pinged", "auv", "asv")
        if k in row
    )


def disagreements(keys: dict, seed: int = 1) -> tuple[list[str], dict[str, int]]:
    """Return what differs, a line for each table's first difference, and how many rows agreed."""
    theirs = tables_of(simulate(Scenario.model_validate(keys), seed=seed))
    drawn = Drawn(
        turns=[row["auv"] for row in theirs["pings"]],
        broadcasters=[row["asv"] for row in theirs["broadcasts"]],
    )
    mission = Second(keys, drawn)
    mission.fly()
    ours = tables_of_second(mission)
    found, counts = [], {}
    for name, rows in theirs.items():
        mine, rows = sorted(ours[name], key=order), sorted(rows, key=order)
        counts[name] = len(rows)
        for a, b in zip(mine, rows, strict=False):
            wrong = [k for k in b if not alike(a.get(k), b[k])]
            if wrong:
                found.append(f"{name}: {', '.join(wrong)}: second {a}, simulator {b}")
                break
        else:
            if len(mine) != len(rows):
                extra = (
                    (mine + rows)[min(len(mine), len(rows))]
                    if len(mine) > len(rows)
                    else rows[len(mine)]
                )
                found.append(f"{name}: second has {len(mine)} rows, simulator {len(rows)}: {extra}")
    return found, counts
