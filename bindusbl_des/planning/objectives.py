"""What a placement of ASVs is worth, without simulation: a number, the less the better."""

from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..geometry.placement import information, trace_of_inverse
from .prediction.inputs import Inputs
from .prediction.predicting import predict
from .prediction.sights import Sights, located, looked_up, seen

Floats = NDArray[np.float64]
Objective: TypeAlias = Literal["coverage", "information", "error"]
#: What places (m, 2), m, are worth.
Value: TypeAlias = Callable[[Floats], float]

# The worst AUV counts most, then all of them, then how near they are to their ASVs, in reaches.
OF_ALL, OF_WAY = 0.1, 1e-3
# The share of signals that are decoded at what counts as the reach of a channel without a limit.
REACHED = 0.5
# From here (m) no ASV hears any AUV.
NOWHERE = ((1e7, 1e7),)
# No estimate is surer than this (m2): priors of AUVs that have just been launched
SUREST_M2 = 1e-6


def objective_of(name: Objective, inputs: Inputs) -> Value:
    """Return the function of places that an objective names, for what is predicted.

    Raises:
        ValueError: for an objective that there is not.
    """
    known = {"coverage": _unserved, "information": _unknown, "error": _predicted}
    if name not in known:
        raise ValueError(f"there is no objective {name!r}; use one of {', '.join(known)}")
    return known[name](inputs)


def reach_of(inputs: Inputs) -> float:
    """Return how far (m), seen from above, ASVs hear the deepest AUV; half of its pings, or more,
    where the channel knows no limit.
    """
    hf, deepest = inputs.hf, float(inputs.ways.depths_m.max())
    slant = hf.range_m
    if not hf.is_cut:
        heard = np.flatnonzero(hf.chances >= REACHED)
        slant = hf.step_m * float(heard[-1]) if len(heard) else 0.0
    if hf.is_cut and not hf.by_slant:
        return slant
    return float(np.sqrt(max(slant**2 - deepest**2, 0.0)))


def _unserved(inputs: Inputs) -> Value:
    """Judge by the share of their ways on which AUVs are heard and told of it."""
    reach = max(reach_of(inputs), 1.0)

    def value(places: Floats) -> float:
        sights = seen(inputs, places)
        served = located(inputs, sights).mean(axis=2) * _told(inputs, sights)
        own, nearest = served.mean(axis=1), sights.level_m.min(axis=2).mean()
        return float(1.0 - own.min() + OF_ALL * (1.0 - own.mean()) + OF_WAY * nearest / reach)

    return value


def _unknown(inputs: Inputs) -> Value:
    """Judge by what is left unknown by one fix after dead reckoning alone."""
    alone = predict(inputs, NOWHERE).error_over_time
    prior = 2.0 / np.maximum(alone**2, 2.0 * SUREST_M2)  # of each axis

    def value(places: Floats) -> float:
        sights, noise = seen(inputs, places), inputs.noise
        heard = sights.heard * _told(inputs, sights)[..., None]
        with np.errstate(divide="ignore"):
            along, across = (
                looked_up(table, noise.step_m, sights.level_m) / heard
                for table in (noise.along_m2, noise.across_m2)
            )
        told = information(inputs.ways.places_m, places, along, across)
        return float(trace_of_inverse(told + prior[..., None, None] * np.eye(2)).mean())

    return value


def _predicted(inputs: Inputs) -> Value:
    """Judge by the predicted error of the worst AUV."""
    return lambda places: predict(inputs, places).worst("position_error_p95_m")


def _told(inputs: Inputs, sights: Sights) -> Floats:
    """Return how likely AUVs decode a frame (n, k), whichever ASV broadcasts it."""
    access, told = inputs.access, sights.told
    replies = access.downlink.replies
    if access.ranging.asvs_ping or (replies and not access.replies_in_frames):
        return np.ones(told.shape[:2])
    if access.broadcaster.chosen_by == "one" and not replies:
        return np.asarray(told[:, :, access.fixed_asv])
    if replies or access.broadcaster.serves_nearest:
        nearest = sights.level_m.argmin(axis=2)[:, :, None]
        return np.asarray(np.take_along_axis(told, nearest, axis=2)[:, :, 0])
    return np.asarray(told.mean(axis=2))
