"""User-defined instruments, whose measurements are checked and fused."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import Floats
from ...support.plugins import PluginError, asked, shown
from ..records.rows import Row, Rows
from ..scenario.families import INSTRUMENT
from ..scenario.part_choice import own_part
from ..vehicles.tracks import FARTHEST
from .fusion import fuse

# Relative tolerance (of its largest entry) for asymmetry and negative eigenvalues of a covariance
ROUNDING = 1e-9


@dataclass(frozen=True)
class Sounding:
    """One ping at the k ASVs that have decoded it, in the survey frame (m, z down).

    `time` (s) is when AUV number `auv` pinged, at `source` (3,), the truth; `asvs` (k,) are the
    numbers of the ASVs, `poses` (k, 4) their x, y, z (m) and yaw (rad) as the ping arrives, and
    `travel_times` (k,), s.  If an ASV called for it, `call_time` (s) is the call's travel time,
    else None.  `random` is the instrument's own random stream for this AUV.

    With passive ranging `asvs` is the one ASV that pinged, at `source`, and the AUV carries the
    instrument, with the pose `poses` (1, 4): it measures where that ASV is.
    """

    time: float
    auv: int
    source: Floats
    asvs: NDArray[np.int64]
    poses: Floats
    travel_times: Floats
    call_time: float | None
    random: np.random.Generator


class MeasureFunction(Protocol):
    """A user's function that measures a ping."""

    def __call__(self, sounding: Sounding, /) -> tuple[Floats, Floats]:
        """Return a fix for each ASV (k, 3), m, and their covariances (k, 3, 3), m2."""


@dataclass(frozen=True)
class OwnInstrument:
    """A user-defined instrument, which every ASV, or with passive ranging every AUV, carries; its
    answers are checked.
    """

    name: str
    measure: MeasureFunction

    def fused(self, sounding: Sounding) -> tuple[Floats, Floats]:
        """Return the fused fix (3,), m, of a ping, and its covariance (3, 3), m2.

        Raises:
            PluginError: when the instrument raises anything, or returns no fixes and covariances.
        """
        places, covariances = self._asked(sounding)
        return fuse(list(places), list(covariances))

    def _asked(self, sounding: Sounding) -> tuple[Floats, Floats]:
        when = f" of the ping at {sounding.time:g} s"
        answer = asked(INSTRUMENT.key, self.name, self.measure, sounding, when=when)
        places, covariances = asked(INSTRUMENT.key, self.name, _arrays, answer, when=when)
        count = len(sounding.asvs)
        if (
            places.shape != (count, 3)
            or covariances.shape != (count, 3, 3)
            or not {places.dtype.kind, covariances.dtype.kind} <= set("fiu")
            or not ((np.abs(places) <= FARTHEST).all() and _are_covariances(covariances))
        ):
            said = shown(INSTRUMENT.key, self.name, answer, when)
            raise PluginError(
                INSTRUMENT.key,
                f"{self.name!r} measured {said}{when}; it must be fixes ({count}, 3) and their "
                f"covariances ({count}, 3, 3), finite, symmetric and not below 0, no fix farther "
                f"off than {FARTHEST:g} m",
            )
        return places.astype(np.float64), covariances.astype(np.float64)


def instrument_named(name: str) -> OwnInstrument | None:
    """Return an instrument by its name in the scenario; None for the compiled array.

    Raises:
        PluginError: when a user-defined one is not allowed, or cannot be loaded or called.
    """
    return (
        None if name in INSTRUMENT.parts else OwnInstrument(name, own_part(INSTRUMENT, name).part)
    )


def sounding_of(ping: Row, heard: Rows, poses: Floats, random: np.random.Generator) -> Sounding:
    """Return a ping at the k ASVs that have decoded it, from its row and its receptions `heard`
    (k,); `poses` (k, 4) as of :class:`Sounding`.
    """
    called = not np.isnan(ping["call_time_s"])
    blended = np.where(np.isnan(heard["lowered"]), 0.0, heard["late_s"])
    return Sounding(
        float(ping["sent_at_s"]),
        int(ping["auv"]),
        np.array([ping["x_m"], ping["y_m"], ping["z_m"]]),
        heard["asv"].copy(),
        poses,
        heard["travel_time_s"] + blended,
        float(ping["call_time_s"]) if called else None,
        random,
    )


def mirrored(
    instrument: OwnInstrument,
    ping: Row,
    reception: Row,
    pose: Sequence[float],
    random: np.random.Generator,
) -> tuple[Floats, Floats]:
    """Return a fix (3,), m, of an AUV that hears an ASV's ping, and its covariance (3, 3), m2.

    The AUV, at its `pose` x, y, z (m), yaw (rad), measures where the ASV is; the offset gives its
    own position (:mod:`.fixes`).
    """
    source = np.array([ping["x_m"], ping["y_m"], ping["z_m"]])
    sounding = Sounding(
        float(ping["sent_at_s"]),
        int(reception["auv"]),
        source,
        np.array([reception["asv"]]),
        np.array([pose]),
        np.array([reception["travel_time_s"]]),
        None,
        random,
    )
    image, covariance = instrument.fused(sounding)
    return source + np.array(pose[:3]) - image, covariance


def _arrays(answer: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the two parts of an answer as arrays, empty ones if there are not two."""
    parts = [np.asarray(part) for part in answer] if isinstance(answer, Iterable) else []
    return (parts[0], parts[1]) if len(parts) == 2 else (np.empty(0), np.empty(0))


def _are_covariances(matrices: Floats) -> bool:
    if not np.isfinite(matrices).all():
        return False
    small = ROUNDING * np.abs(matrices).max(initial=0.0)
    symmetric = np.abs(matrices - matrices.transpose(0, 2, 1)).max(initial=0.0) <= small
    return bool(symmetric and (np.linalg.eigvalsh(matrices) >= -small).all())
