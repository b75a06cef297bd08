"""The JSON Schema of experiment files, for completion in editors."""

from typing import Any

from ...scenario.keys import DIALECT, settable
from ..storage.folder import LARGEST_SEED, MOST_MISSIONS
from ..storage.parts import MISSIONS, metric_schema
from .experiment_file import DETAILS
from .experiment_points import METHODS, MOST_POINTS


def experiment_schema() -> dict[str, Any]:
    """Return the JSON Schema of experiment files; keys that may be varied are suggested."""
    known = {row.key: row.meaning for row in settable() if row.key != "record.detail"}
    return {
        "$schema": DIALECT,
        "title": "Experiment",
        "description": "One scenario varied over points and seeds.",
        "type": "object",
        "required": ["scenario"],
        "additionalProperties": False,
        "properties": {
            "name": _described("name of the campaign; else the file's", type="string"),
            "scenario": _described(
                "scenario file, relative to this file, or the name of one that ships", type="string"
            ),
            "vary": _by_key(
                known,
                "every combination of these values; 2:5 stands for 2, 3, 4, 5, and 0:90:15 for 0, "
                "15 and so on up to 90",
                ["array", "string"],
            ),
            "points": {
                "description": "the points one by one",
                "type": "array",
                "minItems": 1,
                "items": {"type": "object", "properties": _properties(known, None)},
            },
            "sample": _sample(known),
            "seeds": _seeds(),
            "until_ci": _described(
                "run seeds until half the width of the 95 % confidence interval is at most this: a "
                "share of the mean such as 5%, or a number; seeds is the largest number then",
                type="object",
                properties={name: {} for name in metric_schema(MISSIONS).names},
                additionalProperties=False,
                minProperties=1,
            ),
            "detail": _described("metrics only, or every event", enum=list(DETAILS)),
        },
    }


def _described(meaning: str, **rest: Any) -> dict[str, Any]:
    return {"description": meaning, **rest}


def _properties(known: dict[str, str], kind: str | list[str] | None) -> dict[str, Any]:
    only = {"type": kind} if kind else {}
    return {key: _described(meaning, **only) for key, meaning in known.items()}


def _by_key(known: dict[str, str], meaning: str, kind: str | list[str]) -> dict[str, Any]:
    """Return the schema of a section with dotted keys; lists of lists are keys of their own."""
    return _described(
        meaning,
        type="object",
        properties=_properties(known, kind),
        additionalProperties={"type": kind, "minItems": 1},
        minProperties=1,
    )


def _sample(known: dict[str, str]) -> dict[str, Any]:
    return {
        "description": "points spread over ranges (needs scipy)",
        "type": "object",
        "required": ["points", "ranges"],
        "additionalProperties": False,
        "properties": {
            "method": {"enum": list(METHODS), "default": "lhs"},
            "points": {"type": "integer", "minimum": 1, "maximum": MOST_POINTS},
            "seed": {"type": "integer", "minimum": 0, "default": 0},
            "ranges": _by_key(known, "[low, high] of each key", "array"),
        },
    }


def _seeds() -> dict[str, Any]:
    one = {"type": "integer", "minimum": 0, "maximum": LARGEST_SEED}
    return {
        "description": "number of seeds (0, 1, ...) or a list of them",
        "default": 1,
        "oneOf": [
            {"type": "integer", "minimum": 1, "maximum": MOST_MISSIONS},
            {"type": "array", "items": one, "minItems": 1, "uniqueItems": True},
        ],
    }
