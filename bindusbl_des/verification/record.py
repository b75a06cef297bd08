"""What `verify` writes: `verify.json`, and `witness.yaml`, a scenario to be run."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..core.durable_folder import folder_draft
from ..core.kept_files import FOLDERS, copies_of, keep, portable
from .bounds import CHANCE
from .guards import Guard
from .verdict import Verdict
from .witnesses.playing import Signal, Witness

RECORD, WITNESS = "verify.json", "witness.yaml"

Data = dict[str, Any]


def record(verdict: Verdict) -> Data:
    """Return a verdict as plain data: s, m, m/s; what does not apply or is not known is None."""
    bounds, case = verdict.bounds, verdict.case
    slowest, fastest = case.sound_speeds
    return {
        "verdict": verdict.verdict,
        "accepted": verdict.accepted,
        "scenario": verdict.scenario.name,
        "bounds": {
            "max_speed_m_per_s": bounds.max_speed_m_per_s,
            "asv_speed_m_per_s": bounds.asv_speed_m_per_s,
            "clock_error_s": bounds.clock_error_s,
            "sound_speed_error_m_per_s": bounds.sound_speed_error_m_per_s,
            "sound_speed_m_per_s": [slowest, fastest],
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
                "why": pair.why,
            }
            for pair in verdict.pairs
        ],
        "uplink": _guard(verdict.uplink),
        "downlink": _guard(verdict.downlink),
        "conflict_margin": verdict.conflict_margin,
        "frame": verdict.frame,
        "witness": None if verdict.witness is None else _witness(verdict.witness),
        "remedy": None if verdict.remedy is None else dict(verdict.remedy.changes),
    }


def _guard(guard: Guard | None) -> Data | None:
    if guard is None:
        return None
    return {"set_s": guard.set_s, "needed_s": guard.needed_s, "wasted_s": guard.wasted_s}


def _witness(witness: Witness) -> Data:
    return {
        "kind": witness.kind,
        "told": witness.told,
        "seed": witness.seed,
        "receiver": witness.receiver,
        "overlap_s": witness.overlap_s,
        "signals": [_signal(signal) for signal in witness.signals],
    }


def _signal(signal: Signal) -> Data:
    return {
        "what": signal.what,
        "sender": signal.sender,
        "sent_at_s": signal.sent_at_s,
        "place_m": list(signal.place_m),
        "begins_at_s": signal.begins_at_s,
        "ends_at_s": signal.ends_at_s,
    }


def witness_yaml(witness: Witness) -> str:
    """Return the scenario of a witness as a file's text, which says what happens in it."""
    plan = portable(witness.plan)
    first = ["name", "duration_s", *(key for key in plan if key not in ("name", "duration_s"))]
    lines = [
        f"# {witness.kind}: {witness.told}",
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
    foreign: Sequence[str] = sorted(
        it.name for it in folder.iterdir() if it.name not in {RECORD, WITNESS, *FOLDERS}
    )
    if foreign:
        return f"holds {foreign[0]}, which `verify` did not write, so --force will not replace it"
    return None
