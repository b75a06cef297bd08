"""A verdict for the terminal (what may overlap, by how much guards fall short, what would do), and
what `verify` writes: `verify.json`, and `witness.yaml`, a scenario to be run.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from textwrap import wrap
from typing import Any

from ...support.files import folder_draft
from ...support.kept_files import FOLDERS, copies_of, keep, portable
from ...support.wording import significant
from .case import ACCEPTED, CHANCE, REFUSED, UNDECIDED, SignalPair
from .playing import Witness
from .verdict import Guard, Verdict

RECORD, WITNESS = "verify.json", "witness.yaml"

Data = dict[str, Any]


def record(verdict: Verdict) -> Data:
    """Return a verdict as plain data: s, m, m/s; what does not apply or is not known is None."""
    bounds, witness = verdict.bounds, verdict.witness
    lost = f". {verdict.lost}" if verdict.lost else ""
    return {
        "verdict": verdict.verdict,
        "accepted": verdict.accepted,
        "scenario": verdict.scenario.name,
        "bounds": {
            "max_speed_m_per_s": bounds.max_speed_m_per_s,
            "asv_speed_m_per_s": bounds.asv_speed_m_per_s,
            "clock_error_s": bounds.clock_error_s,
            "sound_speed_error_m_per_s": bounds.sound_speed_error_m_per_s,
            "sound_speed_m_per_s": list(verdict.case.sound_speeds),
            "position_error_m": verdict.position_error_m,
            "position_age_s": verdict.position_age_s,
            "chance": CHANCE,
            "standard_deviations": bounds.sigmas,
        },
        "pairs": [
            {
                "kind": pair.kind,
                "what": pair.what,
                "verdict": pair.verdict,
                "margin_s": pair.margin_s,
                "margin_m": pair.margin_m,
                "why": pair.why if pair.is_safe else pair.why + lost,
            }
            for pair in verdict.pairs
        ],
        "uplink": _guard_data(verdict.uplink),
        "downlink": _guard_data(verdict.downlink),
        "conflict_margin": verdict.conflict_margin,
        "frame": verdict.frame,
        "witness": None
        if witness is None
        else {
            "kind": witness.kind,
            "told": witness.words,
            "seed": witness.seed,
            "receiver": witness.receiver,
            "overlap_s": witness.overlap_s,
            "signals": [asdict(signal) for signal in witness.signals],
        },
        "remedy": None if verdict.remedy is None else dict(verdict.remedy.changes),
    }


def _guard_data(guard: Guard | None) -> Data | None:
    return None if guard is None else {**asdict(guard), "wasted_s": guard.wasted_s}


def witness_yaml(witness: Witness) -> str:
    """Return the scenario of a witness as a file's text, which says what happens in it."""
    plan = portable(witness.plan)
    first = dict.fromkeys(("name", "duration_s", *plan))
    lines = [
        f"# {witness.kind}: {witness.words}",
        f"# bindusbl-des run witness.yaml --seed {witness.seed}",
        # JSON is YAML; each section has a line.
        *(f"{key}: {json.dumps(plan[key], ensure_ascii=False)}" for key in first),
    ]
    return "\n".join([*lines, ""])


def write(verdict: Verdict, folder: Path, *, force: bool = False) -> None:
    """Write a verdict into a folder of its own, all of it or nothing, with what a witness names.

    Raises:
        FolderTaken: when the folder exists, and force would not replace a verdict alone.
        OSError: when it cannot be written.
    """
    with folder_draft(folder, objection, force=force) as draft:
        text = json.dumps(record(verdict), indent=2) + "\n"
        (draft / RECORD).write_text(text, encoding="utf-8")
        if verdict.witness is not None:
            keep(copies_of(verdict.witness.plan), draft)
            (draft / WITNESS).write_text(witness_yaml(verdict.witness), encoding="utf-8")


def objection(folder: Path) -> str | None:
    """Return why force must not replace a folder; None for an earlier verdict, or an empty one."""
    if not folder.is_dir():
        return "is no folder"
    foreign = {path.name for path in folder.iterdir()} - {RECORD, WITNESS, *FOLDERS}
    if foreign:
        return f"holds {min(foreign)}, which `verify` did not write, so --force will not replace it"
    return None


WIDTH = 80

MEANT = {
    ACCEPTED: "accepted: no two signals overlap",
    REFUSED: "refused: two signals overlap",
    UNDECIDED: "undecided: not proved safe, nor seen to collide",
}
LOSES = "undecided: not proved safe, and signals are lost"


def verdict_text(verdict: Verdict) -> str:
    """Return a verdict in lines of at most 80 columns."""
    return "\n".join(_lines(verdict))


def _lines(verdict: Verdict) -> Iterator[str]:
    meant = LOSES if verdict.lost else MEANT[verdict.verdict]
    yield f"{verdict.scenario.name}: {meant}"
    yield _bounds(verdict)
    yield (
        f"Gaussian errors within {verdict.bounds.sigmas:.2f} standard deviations: all but "
        f"{CHANCE:g} of missions"
    )
    yield ""
    rows = [("signals", "where", "margin", "verdict"), *map(_row, verdict.pairs)]
    widths = [max(len(row[k]) for row in rows) for k in range(4)]
    for number, (kind, what, margin, word) in enumerate(rows):
        line = f"{kind:<{widths[0]}}  {what:<{widths[1]}}  {margin:>{widths[2]}}  {word}"
        yield line.rstrip()
        if number == 0:
            yield "-" * (sum(widths) + 6)
    yield ""
    yield from _guards(verdict)
    if verdict.accepted:
        return
    for why in dict.fromkeys(
        f"{pair.kind}: {pair.why}." for pair in verdict.pairs if not pair.is_safe
    ):
        yield from wrap(why, WIDTH)
    if verdict.witness is not None:
        yield from wrap(f"Witness: {_seen(verdict.witness)}.", WIDTH)
    elif verdict.lost:
        yield from wrap(f"In a mission of it: {verdict.lost}", WIDTH)
    else:
        yield "No witness: no mission was seen in which two signals overlap."
    if verdict.remedy is None:
        yield "No guard, margin or schedule is known that would be accepted."
        return
    yield "Accepted would be:"
    yield from (f"  {option}" for option in verdict.remedy.options)


def _bounds(verdict: Verdict) -> str:
    bounds, (slowest, fastest) = verdict.bounds, verdict.case.sound_speeds
    sound = f"{slowest:g} m/s" if slowest == fastest else f"{slowest:g} to {fastest:g} m/s"
    vessels = f", ASVs {bounds.asv_speed_m_per_s:.3g} m/s" if bounds.asv_speed_m_per_s else ""
    return (
        f"AUVs up to {bounds.max_speed_m_per_s:.3g} m/s{vessels}, clocks within "
        f"{1e3 * bounds.clock_error_s:.4g} ms, sound at {sound}"
    )


def _row(pair: SignalPair) -> tuple[str, str, str, str]:
    if pair.margin_s is not None:
        margin = f"{_ms(pair.margin_s)} ms"
    elif pair.margin_m is not None:
        margin = f"{_signed(pair.margin_m)} m"
    else:
        margin = "-"
    word = pair.verdict if pair.verdict == ACCEPTED else pair.verdict.upper()
    return pair.kind, pair.what, margin, word


def _ms(seconds: float) -> str:
    return _signed(1e3 * seconds)


def _signed(value: float) -> str:
    return f"-{significant(-value)}" if value < 0.0 else significant(value)


def _guards(verdict: Verdict) -> Iterator[str]:
    for name, guard in (("uplink", verdict.uplink), ("downlink", verdict.downlink)):
        if guard is not None:
            rest = "wasted" if guard.wasted_s >= 0.0 else "lacking"
            yield (
                f"{name + ' guard':<16} {_ms(guard.set_s):>8} ms set, {_ms(guard.needed_s):>7} ms "
                f"needed, {_ms(abs(guard.wasted_s)):>7} ms {rest}"
            )
    margin, frame = verdict.conflict_margin, verdict.frame
    if frame is not None and not frame["fits"]:
        yield (
            f"A round may last {frame['round_s']:.4g} s, its frame {frame['frame_s']:.4g} s: "
            "rounds begin late."
        )
    if margin is not None:
        is_set, least = margin["set_m"] or 0.0, margin["needed_m"]
        needed = "none is enough" if least is None else f"{significant(least):>8} m needed"
        yield f"{'conflict margin':<16} {significant(is_set):>8} m set, {needed}"


def _seen(witness: Witness) -> str:
    one, other = witness.signals
    both = " and ".join(f"{signal.sender}'s {signal.what}" for signal in (one, other))
    return (
        f"{both} are at {witness.receiver} together for {_ms(witness.overlap_s)} ms, from "
        f"{other.begins_at_s:.4f} s on"
    )
