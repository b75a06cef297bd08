"""What the paper leaves open, and joint readings: one choice of each for all numbers."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from bindusbl_des.support.wording import did_you_mean

from .numbers import published

# What the paper leaves open, and the ways to read it: the factors of a joint reading.


@dataclass(frozen=True)
class Factor:
    """What the paper leaves open, the ways to read it, and where the errata argue it."""

    name: str
    question: str
    errata: str
    choices: Mapping[str, str]


FACTORS = (
    Factor(
        "error",
        'what a "mean cross-track error" is: 10-11 m cannot lie across the track, and the '
        'sweep\'s figure says "mean position error"',
        "E8",
        {
            "cross_track": "mean error across the track",
            "position": "mean horizontal error",
            "position_rms": "root mean square of the horizontal error",
            "position_p95": "95 % quantile of the horizontal error",
        },
    ),
    Factor(
        "bias",
        "eq. dead_reckoning turns the bias with the AUV, the text lets drift grow without bound",
        "E7",
        {"body": "the bias turns with the AUV", "world": "the bias keeps its direction"},
    ),
    Factor(
        "delay",
        'eq. update compares a fix with the present, the abstract has "delayed fusion"',
        "E10",
        {
            "none": "a fix is compared with the estimate at its delivery",
            "shift": "a fix is compared with the estimate at its ping",
        },
    ),
    Factor(
        "loss",
        "the loss law is negative at every range within 106 m, its contention term has no cause "
        'under TDMA, and the baseline is called "ideal"',
        "E1, E2, E3",
        {
            "clamp_first": "the law made a probability before contention is added, none in the "
            "baseline",
            "clamp_first_everywhere": "the same, in the baseline too",
            "paper_raw": "the literal sum, no loss in the baseline",
            "paper_raw_everywhere": "the literal sum, in the baseline too",
            "off": "no contention, and so no loss within range, anywhere",
        },
    ),
    Factor(
        "turns",
        "the baseline's AUVs are served one per second, with shares of 24.3 to 25.9 %",
        "E26",
        {
            "in_turn": "the baseline serves one AUV after the other",
            "by_lot": "the baseline draws an AUV every second",
        },
    ),
    Factor(
        "reply",
        "51 ms leave no room for the protocol's own airtime, so the baseline's ASV answers at "
        "once; at once after what?",
        "E23",
        {
            "ping_front": "the baseline's ASV answers the ping's front",
            "ping_end": "the baseline's ASV answers the ping's end",
        },
    ),
    Factor(
        "speed",
        "no speed is given; the distances of Table I are 182 to 192 m",
        "E28",
        {
            "common_speed": "all AUVs fly at their mean, 0.627 m/s",
            "published_speeds": "each AUV flies at its own, the published distance over 300 s",
        },
    ),
    Factor(
        "sweep",
        '"the distance-normalised protocol holds total team travel approximately constant", which '
        "the heatmap contradicts",
        "E31",
        {
            "equal_time": "every team flies 300 s",
            "equal_distance": "every team flies what three AUVs fly in 300 s",
        },
    ),
)
# The factor of each choice; no two factors share one.
FACTOR_OF = {choice: factor.name for factor in FACTORS for choice in factor.choices}


# Joint readings: one choice for everything that the paper leaves open, for all its numbers.


Sets = dict[str, Any]

# "188 m in 300 s": the mean of the published distances, which the scenarios fly
COMMON_SPEED = 0.627
MISSION_S = 300.0

METRICS = {
    "cross_track": "cross_track_error_m",
    "position": "position_error_m",
    "position_rms": "position_error_rms_m",
    "position_p95": "position_error_p95_m",
}
ERRORS = {
    "cross_track": "cross-track error",
    "position": "position error",
    "position_rms": "RMS position error",
    "position_p95": "95 % position error",
}
SWEEPS = {"equal_time": "sweep", "equal_distance": "sweep_distance"}
TURNS = {"in_turn": "round_robin", "by_lot": "random"}
EVERYWHERE = "_everywhere"


class UnknownReading(ValueError):
    """A reading was asked for that there is not."""


@dataclass(frozen=True)
class Reading:
    """One way to read all that the paper leaves open: a choice of each factor.

    The first choices are those in which the page measures every number first.
    """

    error: str = "cross_track"
    bias: str = "body"
    delay: str = "none"
    loss: str = "clamp_first"
    turns: str = "in_turn"
    reply: str = "ping_front"
    speed: str = "common_speed"
    sweep: str = "equal_time"

    @property
    def words(self) -> tuple[str, ...]:
        """The choices in the order of the factors."""
        return tuple(getattr(self, factor.name) for factor in FACTORS)

    @property
    def name(self) -> str:
        """What it is called: the choices in which it differs from `default`.

        >>> Reading(bias="world", delay="shift").name
        'world/shift'
        """
        return "/".join(w for w, d in zip(self.words, DEFAULT.words, strict=True) if w != d) or (
            "default"
        )

    @property
    def metric(self) -> str:
        """The column that holds its error."""
        return METRICS[self.error]

    @property
    def error_words(self) -> str:
        """What it takes the paper's error to be.

        >>> Reading(error="position", bias="world").error_words
        'position error, world bias'
        """
        bias = ", world bias" if self.bias == "world" else ""
        return f"{ERRORS[self.error]}{bias}{', delay shifted' if self.delay == 'shift' else ''}"

    @property
    def fusion(self) -> Sets:
        """The keys that its error depends on: the bias, and what a late fix is compared with."""
        return {
            "navigation.bias_frame": self.bias,
            "navigation.filter.delay_compensation": self.delay,
        }

    @property
    def missions(self) -> Sets:
        """The keys that it sets in case study and sweep."""
        combine = self.loss.removesuffix(EVERYWHERE)
        return {**self.fusion, "acoustics.loss.combine": combine}

    @property
    def baseline(self) -> Sets:
        """The keys that it sets in the baseline."""
        everywhere = self.loss.endswith(EVERYWHERE)
        return {
            "protocol.schedule": TURNS[self.turns],
            "protocol.downlink.reply_at": self.reply,
            "acoustics.loss.combine": self.loss.removesuffix(EVERYWHERE) if everywhere else "off",
        }

    def speed_of(self, auv: str) -> float:
        """Return the speed (m/s) at which an AUV of the case study flies."""
        return PUBLISHED_SPEEDS[auv] if self.speed == "published_speeds" else COMMON_SPEED

    def switched(self, choice: str) -> "Reading":
        """Return the reading with one choice changed."""
        return replace(self, **{FACTOR_OF[choice]: choice})


def _published_speeds() -> dict[str, float]:
    """Return the speed (m/s) of each AUV of Table I: the distance it travelled over 300 s."""
    return {
        row.auv: round(row.value / MISSION_S, 6)
        for row in published()
        if row.quantity == "distance"
    }


PUBLISHED_SPEEDS = _published_speeds()
DEFAULT = Reading()

# The winner of the full count in docs/reproduction.md
LIKELY = Reading(
    error="position", bias="world", delay="shift", turns="by_lot", speed="published_speeds"
)

NAMED = {"default": DEFAULT, "likely": LIKELY}


def readings() -> Iterator[Reading]:
    """Yield every joint reading, the last factor varying fastest."""
    for words in product(*(factor.choices for factor in FACTORS)):
        yield Reading(*words)


def reading_named(name: str) -> Reading:
    """Return the reading that is called so: `default`, `likely`, or choices joined by ``/``.

    What is not named stays as in `default`, or in the reading that comes first.

    >>> reading_named("world/position").name
    'position/world'

    Raises:
        UnknownReading: when a word is none of them, or two choose differently of one factor.
    """
    first, *rest = name.split("/")
    found = NAMED.get(first, DEFAULT)
    words = rest if first in NAMED else [first, *rest]
    chosen: dict[str, str] = {}
    for word in words:
        factor = FACTOR_OF.get(word)
        if factor is None:
            hint = did_you_mean(word, (*NAMED, *FACTOR_OF))
            raise UnknownReading(
                f"{name!r} names no reading: {word!r} is unknown{hint}\n{listed()}"
            )
        if chosen.setdefault(factor, word) != word:
            raise UnknownReading(
                f"{name!r} names no reading: {chosen[factor]} and {word} are both choices of "
                f"{factor}; keep one"
            )
        found = found.switched(word)
    return found


def listed() -> str:
    """Return all names in a few lines."""
    lines = [f"  {factor.name:<8}{', '.join(factor.choices)}" for factor in FACTORS]
    return "\n".join(
        (
            f"a reading is {', '.join(NAMED)}, or choices joined by '/' (the first of each factor "
            "unless named):",
            *lines,
        )
    )
