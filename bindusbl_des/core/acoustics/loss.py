"""The probability that a ping is lost: a law of range, and what other AUVs add."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled
from ...support.wording import refuse

# Range (m) beyond which the loss law is held constant (eq. fix_loss).
LONGEST_LOSS_RANGE = 800.0

# The law is fitted to pings within this range (m); `scaled` stretches it to the HF range.
FITTED_RANGE = 100.0

# Largest loss probability by range alone (eq. fix_loss_total; same cap in the thesis simulator).
LARGEST_RANGE_LOSS = 0.999


@dataclass(frozen=True)
class LossLaw:
    """Loss probability of a ping over range r (m): a e^(b r) + c e^(d r) (eq. fix_loss).

    It is constant beyond `longest_m` (m).
    """

    a: float
    b: float
    c: float
    d: float
    source: str
    longest_m: float = LONGEST_LOSS_RANGE

    @property
    def coefficients(self) -> Floats:
        """a, b, c, d, and the longest range (m), for compiled code, (5,)."""
        return np.array((self.a, self.b, self.c, self.d, self.longest_m))


_SIMULATOR = "github.com/rwth-irt/USBL-Simulator (e9f29b7)"

LOSS_LAWS: Mapping[str, LossLaw] = MappingProxyType(
    {
        "paper": LossLaw(-6.070, 2.12e-3, 5.987, 2.25e-3, "paper, eq. fix_loss"),
        "thesis": LossLaw(
            -6.07039718341056,
            0.00212458825600739,
            5.98749360969012,
            0.00225378907075506,
            f"M. Nitsch, RWTH Aachen 2024, doi 10.18154/RWTH-2024-05964; digits of {_SIMULATOR}",
        ),
        "head": LossLaw(
            0.0037, 0.0174, 0.0, 0.0174, f"OEM 120/180 kHz head, settings shipped in {_SIMULATOR}"
        ),
        "none": LossLaw(0.0, 0.0, 0.0, 0.0, "no loss by range"),
    }
)


def loss_law(name: str, hf_range: float) -> LossLaw:
    """Return the loss law that a scenario names, for its HF range (m).

    `scaled` is the paper's law at r min(1, 100 m / R_HF): the paper's law is fitted to less than
    100 m and exceeds 1 beyond 517.6 m, so at a longer HF range it has the loss of 100 m.

    >>> round(range_loss(1200.0, loss_law("scaled", 1000.0)), 6)
    0.014354
    >>> loss_law("scaled", 100.0).coefficients.tolist() == LOSS_LAWS["paper"].coefficients.tolist()
    True
    """
    if name != "scaled":
        return LOSS_LAWS[name]
    paper, shrink = LOSS_LAWS["paper"], min(1.0, FITTED_RANGE / hf_range)
    return LossLaw(
        paper.a, paper.b * shrink, paper.c, paper.d * shrink,
        f"{paper.source}, at {shrink:.3g} of the range", paper.longest_m / shrink,
    )  # fmt: skip


def range_loss(slant_range: float, law: LossLaw = LOSS_LAWS["paper"]) -> float:
    """Return the raw value of the loss law at a slant range (m): not yet a probability.

    The law is the paper's unless another is given.  'paper' and 'thesis' are negative below
    105.909 m and 106.432 m and exceed 1 beyond 517.6 m and 518.8 m, 'head' exceeds 1 beyond
    321.8 m: a combiner makes it a probability.  Beyond 800 m the law is held constant.  Raises
    ValueError for a range that is negative or not finite.
    Source: eq. fix_loss.

    >>> round(range_loss(50.0), 6)
    -0.048873
    """
    if not 0.0 <= slant_range < math.inf:
        refuse("slant range", slant_range, "be a finite number not below 0", "give it in metres")
    return _law(slant_range, law.a, law.b, law.c, law.d, law.longest_m)


@compiled
def _law(slant_range: float, a: float, b: float, c: float, d: float, longest: float) -> float:
    reach = min(slant_range, longest)
    return a * math.exp(b * reach) + c * math.exp(d * reach)


def contention_loss(auv_count: int, per_auv: float = 0.05) -> float:
    """Return what AUVs that share the uplink add to the loss of each ping, (N - 1) P_col.

    Raises ValueError for less than one AUV or a `per_auv` outside [0, 1].
    Source: eq. fix_loss_total, P_col = 0.05 per additional AUV.

    >>> round(contention_loss(4), 3)
    0.15
    """
    if auv_count < 1:
        refuse("AUV count", auv_count, "be at least 1", "count the pinging AUV itself")
    if not 0.0 <= per_auv <= 1.0:
        refuse("loss per additional AUV", per_auv, "lie in [0, 1]", "the paper has 0.05")
    return (auv_count - 1) * per_auv


@compiled
def clamp_first(loss: float, contention: float, cap: float) -> float:
    """Return the loss probability of a ping, the range loss clamped to [0, 0.999] before adding.

    >>> round(clamp_first(range_loss(50.0), contention_loss(3), 0.999), 6)
    0.1
    """
    return min(min(max(loss, 0.0), LARGEST_RANGE_LOSS) + contention, cap)


@compiled
def paper_raw(loss: float, contention: float, cap: float) -> float:
    """Return the loss probability of a ping by the paper's literal sum (eq. fix_loss_total).

    Below 106 m the negative law reduces the contention by up to 0.083.

    >>> round(paper_raw(range_loss(50.0, LOSS_LAWS["paper"]), contention_loss(3), 0.999), 6)
    0.051127
    """
    return max(0.0, min(loss + contention, cap))


@compiled
def off(loss: float, contention: float, cap: float) -> float:
    """Return the loss probability of a ping by range alone: collisions are simulated.

    >>> off(range_loss(50.0), contention_loss(3), 0.999)
    0.0
    """
    return min(max(loss, 0.0), cap)


# (range loss, contention, cap) -> probability in [0, cap]
COMBINERS: Mapping[str, Callable[[float, float, float], float]] = MappingProxyType(
    {"clamp_first": clamp_first, "paper_raw": paper_raw, "off": off}
)


class LossTerms(NamedTuple):
    """A scenario's law of loss: the coefficients (5,) of a loss law, the index of a combiner in
    COMBINERS, what other AUVs add, and the largest probability.
    """

    coefficients: Floats
    combine: int
    contention: float
    cap: float

    def over(self, ranges: Floats) -> Floats:
        """Return the loss probabilities (n,) of pings over slant ranges (n,), m."""
        return losses(ranges, *self)


@compiled
def loss_probability(slant_range: float, terms: LossTerms) -> float:
    """Return the loss probability of a ping over a slant range (m)."""
    own = terms.coefficients
    loss = _law(slant_range, own[0], own[1], own[2], own[3], own[4])
    if terms.combine == 0:
        return clamp_first(loss, terms.contention, terms.cap)
    if terms.combine == 1:
        return paper_raw(loss, terms.contention, terms.cap)
    return off(loss, terms.contention, terms.cap)


@compiled
def chance_of(luck: float) -> float:
    """Return luck, a standard normal, as a uniform number in [0, 1]: a signal is lost if that is
    below its loss probability.

    >>> chance_of(0.0)
    0.5
    """
    return 0.5 * math.erfc(-luck / math.sqrt(2.0))


@compiled
def losses(
    ranges: Floats, coefficients: Floats, combine: int, contention: float, cap: float
) -> Floats:
    """Return the probabilities (n,) that pings are lost over slant ranges (n,), m; the others are
    the fields of :class:`LossTerms`.
    """
    out = np.empty(ranges.size)
    terms = LossTerms(coefficients, combine, contention, cap)
    for k in range(ranges.size):
        out[k] = loss_probability(ranges[k], terms)
    return out
