"""Channels: whether a signal is decoded if nothing overlaps it, and how strong a sound it is.

The default, `disc`, is compiled: out of range beyond a reach, and within it the loss of
:mod:`.loss`.  All others are asked, in numpy, for all signals that begin at one instant.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan
from numbers import Real
from typing import Any, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import Floats, Ints
from ...support.plugins import Family, PluginError, asked, loaded, shown
from ..scenario.part_choice import own_part
from .loss import LossTerms
from .propagation import PROSPECT

Prospects = NDArray[np.void]
Value = TypeVar("Value", float, Floats)

# Signals with a smaller chance of being decoded are out of range.
SELDOM = 1e-6


class Receiver(NamedTuple):
    """How a receiver tells a signal from others that overlap it, and the reference of its levels.

    A signal is destroyed by sounds that overlap it unless its intensity is `capture` times that of
    noise and all of them together; infinite: any destroy it.  SNR varies from signal to signal by
    `shadowing_sd_db`.  Levels are in dB: `noise_db` is the noise in the band, re 1 uPa, and
    `threshold_db` the SNR at which half of all signals are decoded; NaN where there are no levels.
    """

    capture: float = inf
    shadowing_sd_db: float = 0.0
    noise_db: float = nan
    threshold_db: float = nan

    def levels(self, snr_db: Value) -> dict[str, Value]:
        """Return the columns of signals with an SNR (dB): SNR, level and margin."""
        level, margin = snr_db + self.noise_db, snr_db - self.threshold_db
        return {"snr_db": snr_db, "level_db": level, "margin_db": margin}


PLAIN = Receiver()

# Placeholder for the compiled loss where another channel is asked
NO_LOSS = LossTerms(np.zeros(5), 0, 0.0, 1.0)

# The largest level (dB), and how much sooner (s per m) than on a straight ray a signal may arrive:
# no sound arrives before it is sent.
LOUDEST, SOONEST = 400.0, 0.9 / 1700.0

# Parts of a user-defined channel's answer: least and largest value, and the words for them.
ANSWERS = {
    "chance": (0.0, 1.0, "probabilities in [0, 1]"),
    "level_db": (-LOUDEST, LOUDEST, f"levels (dB) within {LOUDEST:g}"),
    "delay_s": (-60.0, 60.0, "times (s) within a minute"),
    "delay_sd_s": (0.0, 60.0, "times (s) from 0 to a minute"),
}

# Adds up three axes: quicker than `sum` for the few signals of a slot
AXES = np.ones(3)


@dataclass(frozen=True)
class Signals:
    """Signals that begin at an instant (s) between n AUVs and m ASVs: pings, or calls for them.

    For the ping of an ASV (passive ranging) the channel is asked for all ASVs, and that one's
    column is used; for a frame on MF it is asked for the one ASV that sends it.

    `auvs` (n, 3) and `asvs` (m, 3) are true positions (m), `ranges` (n, m) the slant ranges (m) of
    that instant; `reach` (m) is the protocol's range; `calling` is true if the sound travels from
    ASVs to AUVs.

    `auv_numbers` (n,) and `asv_numbers` (m,) are the vehicles' numbers, `band` is hf or mf, and
    `random` the random stream of the band's channel; numbers and stream are None for positions
    without vehicles.  With access programs (protocol.access) any vehicle may listen: AUVs among the
    ASVs have the numbers -1 - k, and ASVs among the AUVs as well.
    """

    time: float
    auvs: Floats
    asvs: Floats
    ranges: Floats
    reach: float
    calling: bool
    auv_numbers: Ints | None = None
    asv_numbers: Ints | None = None
    band: str = "hf"
    random: np.random.Generator | None = None


def between(
    time: float, auvs: Floats, asvs: Floats, reach: float, calling: bool, *named: Any
) -> Signals:
    """Return the signals of an instant (s) between positions of AUVs (n, 3) and ASVs (m, 3), m;
    further arguments are fields of :class:`Signals`, `named` its last ones.
    """
    apart = auvs[:, None] - asvs
    ranges = np.sqrt((apart * apart) @ AXES)
    return Signals(time, auvs, asvs, ranges, reach, calling, *named)


def heard_from(
    channel: "AskedChannel", time: float, sender: int, around: tuple[Floats, Floats],
    listeners: int, reach: float, band: str, random: np.random.Generator | None,
) -> NDArray[np.void]:  # fmt: skip
    """Return a channel's answer about a signal that vehicle `sender` begins at an instant (s), at
    the first so many vehicles (listeners,), :data:`PROSPECT`; `around` are the positions of AUVs
    (n, 3) and ASVs (m, 3), m, in the order of their numbers; the last arguments are fields of
    :class:`Signals`.
    """
    auvs, places = len(around[0]), np.concatenate(around)
    numbers, own = np.arange(listeners), np.array([sender])
    here, there = places[[sender]], places[:listeners]
    if sender < auvs:
        others = np.where(numbers < auvs, -1 - numbers, numbers - auvs)
        asked = between(time, here, there, reach, False, own, others, band, random)
        return np.ascontiguousarray(channel.prospects(asked)[0])
    others = np.where(numbers < auvs, numbers, auvs - 1 - numbers)
    asked = between(time, there, here, reach, True, others, own - auvs, band, random)
    return np.ascontiguousarray(channel.prospects(asked)[:, 0])


Answer = Floats | Mapping[str, Floats]


class Channel(Protocol):
    """A user-defined channel: returns how likely signals are decoded."""

    def __call__(self, signals: Signals, /) -> Answer:
        """Return the probability (n, m) that each signal is decoded if nothing overlaps it.

        A signal with probability 0 makes no sound either.  The answer may also be a mapping of
        `chance` and optionally `level_db` (dB), `delay_s` (s later than on a straight ray) and
        `delay_sd_s` (s, standard deviation of a random delay beside it), (n, m) each.
        """


class AskedChannel(Protocol):
    """A channel that is asked for the signals of an instant: any but the disc."""

    @property
    def receiver(self) -> Receiver:
        """How receivers of this channel tell a signal from sounds that overlap it."""

    @property
    def audible_m(self) -> float | None:
        """How far (m) a signal drowns others; None: as far as it may be decoded."""

    def prospects(self, signals: Signals) -> Prospects:
        """Return its answer about each signal (n, m), :data:`PROSPECT`."""


@runtime_checkable
class LevelledChannel(AskedChannel, Protocol):
    """A channel with levels, whose source level (dB re 1 uPa at 1 m) may be changed."""

    @property
    def source_level_db(self) -> float:
        """The source level of signals."""

    def at_level(self, level_db: float) -> AskedChannel:
        """Return the channel of signals that are sent at another level."""


@dataclass(frozen=True)
class OwnChannel:
    """A user-defined channel, whose answers are checked."""

    key: str
    name: str
    chances: Channel
    receiver: Receiver = PLAIN
    audible_m: float | None = None

    def prospects(self, signals: Signals) -> Prospects:
        """Return the answer about each signal (n, m); one that is never decoded drowns nothing.

        Raises:
            PluginError: when the channel raises anything, or returns no probabilities.
        """
        when = f" at {signals.time:g} s"
        answer = asked(self.key, self.name, self.chances, signals, when=when)
        given = answer if isinstance(answer, Mapping) else {"chance": answer}
        strange = [str(name) for name in given if name not in ANSWERS]
        if "chance" not in given or strange:
            what = f"{', '.join(strange)} as well" if strange else "no chance"
            raise PluginError(
                self.key,
                f"{self.name!r} returned {what}{when}; a mapping has {', '.join(ANSWERS)}, of "
                "which chance must be there",
            )
        parts = {name: self._part(name, value, signals, when) for name, value in given.items()}
        chance = parts["chance"]
        drawn = np.zeros(chance.shape, PROSPECT)
        drawn["loss"], drawn["snr_db"] = 1.0 - chance, nan
        drawn["sound"], drawn["late_s"] = chance > 0, 0.0
        if "level_db" in parts:
            drawn["snr_db"] = parts["level_db"] - self.receiver.noise_db
            drawn["sound"] = np.where(chance > 0, 10.0 ** (drawn["snr_db"] / 10.0), 0.0)
        late = parts.get("delay_s", drawn["late_s"])
        if "delay_sd_s" in parts and signals.random is not None:
            late = late + parts["delay_sd_s"] * signals.random.standard_normal(chance.shape)
        drawn["late_s"] = np.maximum(late, -SOONEST * signals.ranges)
        return drawn

    def _part(self, name: str, value: Any, signals: Signals, when: str) -> Floats:
        """Return a part of an answer, numbers (n, m) within their limits.

        Raises:
            PluginError: when it is not.
        """
        found = asked(self.key, self.name, np.asarray, value, when=when)
        wanted, (low, high, what) = signals.ranges.shape, ANSWERS[name]
        plain = found.dtype.kind in "fiub" and found.shape == wanted
        if not plain or not ((found >= low) & (found <= high)).all():
            said = shown(self.key, self.name, value, when)
            of = "" if name == "chance" else f" as {name}"
            raise PluginError(
                self.key,
                f"{self.name!r} returned {said}{of}{when}; it must be an array of {what}, "
                f"{wanted[0]} AUVs by {wanted[1]} ASVs",
            )
        return np.asarray(found, dtype=np.float64)


def own_channel(family: Family[Any], choice: str) -> OwnChannel:
    """Return a user-defined channel.

    Raises:
        PluginError: when it is not allowed, or cannot be loaded or called.
    """
    part, own = own_part(family, choice).part, loaded(choice)
    noise, capture = (
        asked(family.key, choice, getattr, own, name, None) for name in ("noise_db", "capture_db")
    )
    for name, value in (("noise_db", noise), ("capture_db", capture)):
        if value is not None and not (isinstance(value, Real) and abs(float(value)) <= LOUDEST):
            raise PluginError(
                family.key, f"{choice!r} declares {name} = {value!r}; give a number of dB"
            )
    receiver = Receiver(
        inf if capture is None else 10.0 ** (float(capture) / 10.0),
        noise_db=0.0 if noise is None else float(noise),
    )
    return OwnChannel(family.key, choice, part, receiver)
