"""Poses of an outside program: when it is asked, what lies between two answers, what is refused."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from bindusbl_des.core.vehicles.motion import lines, place_at
from bindusbl_des.core.vehicles.poses import PosedVehicle, Poses

COUNTS = {"auvs": 2, "asvs": 1}
STEP = 0.1  # s


class Moved:
    """A program that moves two AUVs; it remembers when it was asked."""

    def __init__(self, pose: Callable[[float], Any]) -> None:
        self.pose, self.asked = pose, list[float]()

    def advance_to(self, time: float) -> Mapping[str, Any]:
        self.asked.append(time)
        return {"auvs": [self.pose(time), (0.0, 0.0, 5.0, 0.0)]}


def poses(source: Any, step: float = STEP) -> Poses:
    """Return the poses of a mission of 20 s, predicted for a second."""
    return Poses(source, step, COUNTS, 21.0, 1.0)


def farthest(pose: Callable[[float], Any], step: float = STEP) -> np.ndarray:
    """Return how far what is interpolated is from a motion, along each axis, after two steps."""
    held, times = poses(Moved(pose), step), np.linspace(2 * step, 20.0, 20_011)
    held.advance(20.0)
    found = lines(*held.motion("auvs"), 0, times)[:, :4]
    return np.asarray(np.abs(found - [pose(time) for time in times]).max(axis=0))


def test_it_is_asked_for_each_step_once_and_no_further_than_needed() -> None:
    """Samples are k * step; an instant needs the first that is not before it."""
    source = Moved(lambda time: (time, 0.0, 5.0, 0.0))
    held = poses(source)
    assert source.asked == [0.0]
    for instant, last in ((0.0, 0), (0.05, 1), (0.1, 1), (0.02, 1), (3 * STEP, 3), (0.31, 4)):
        held.advance(instant)
        assert source.asked == [line * STEP for line in range(last + 1)]


@pytest.mark.parametrize("step", [0.1, 0.05])
def test_between_samples_motion_is_as_smooth_as_it_was(step: float) -> None:
    """Errors are below 0.04 jerk step^3, and below 0.07 of a jump of acceleration times step^2."""
    smooth = farthest(lambda time: (np.sin(time), np.cos(time), 5.0, 0.3 * np.sin(time)), step)
    assert (smooth <= np.array([0.04, 0.04, 0.0, 0.3 * 0.04]) * step**3).all()
    for share in np.linspace(0.0, 1.0, 7):
        begins = 5.0 + share * step
        jump = farthest(lambda time, t=begins: (0.5 * max(time - t, 0) ** 2, 0.0, 5.0, 0.0), step)
        assert jump[0] <= 0.07 * step**2
        kink = farthest(lambda time, t=begins: (max(time - t, 0), 0.0, 5.0, 0.0), step)
        assert kink[0] <= 0.2 * step


def test_a_heading_may_turn_about_however_it_is_written() -> None:
    """A vehicle that turns on and on has a steady turn rate, though yaw jumps by a whole turn."""
    held = poses(Moved(lambda time: (0.0, 0.0, 5.0, np.remainder(time + np.pi, 2 * np.pi) - np.pi)))
    vehicle, times = PosedVehicle(held, "auvs", 0), np.linspace(0.0, 20.0, 777)
    assert vehicle.sample(times)[:, 3] == pytest.approx(times, abs=1e-9)
    integrals = np.column_stack((np.sin(times), 1.0 - np.cos(times)))
    assert vehicle.heading_integral(times) == pytest.approx(integrals, abs=1e-6)


def test_what_was_not_asked_for_is_predicted_at_constant_velocity() -> None:
    """A vehicle that will stop dead at 1 s is, until then, believed to go on."""
    held = poses(Moved(lambda time: (2.0 * min(time, 1.0), -min(time, 1.0), 5.0, 0.5)))
    held.advance(1.0)
    for ahead in (0.01, 0.3, 0.99):
        assert place_at(*held.motion("auvs"), 0, 1.0 + ahead) == pytest.approx(
            (2.0 * (1.0 + ahead), -(1.0 + ahead), 5.0, 0.5), abs=1e-12
        )
    vehicle = PosedVehicle(held, "auvs", 0)
    assert vehicle.at(1.5) == pytest.approx((2.0, -1.0, 5.0, 0.5), abs=1e-12)
    assert vehicle.distance(20.0) == pytest.approx(np.hypot(2.0, 1.0), abs=0.15)
    assert vehicle.saturated(20.0) is None
    assert len(vehicle.path_error(np.zeros(3))) == 0


GOOD = ((1.0, 2.0, 5.0, 0.0), (3.0, 4.0, 5.0, 0.0))


class Wrong:
    """A program whose second answer, at 0.1 s, is wrong."""

    def __init__(self, answer: Any, stands_at: float | None = None) -> None:
        self.answer, self.stands_at = answer, stands_at

    def advance_to(self, time: float) -> Any:
        if self.stands_at is not None:
            self.time = self.stands_at if time else 0.0
        return self.answer if time else {"auvs": GOOD}


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        ([GOOD], "must be a dict with the poses of 'auvs', of 'asvs' or of both"),
        ({"auv": GOOD}, r"must be a dict .* got \['auv'\]"),
        ({}, "must be a dict"),
        ({"auvs": GOOD, "asvs": GOOD[:1]}, "has poses of asvs, auvs; at 0 s it had those of auvs"),
        ({"auvs": GOOD[:1]}, r"each of the 2 AUVs: auvs of shape \(2, 4\), got shape \(1, 4\)"),
        ({"auvs": [row[:3] for row in GOOD]}, r"of shape \(2, 4\), got shape \(2, 3\)"),
        ({"auvs": "north"}, r"of shape \(2, 4\), got 'north'"),
        ({"auvs": [GOOD[0], GOOD[1][:2]]}, r"of shape \(2, 4\), got \["),
        ({"auvs": (GOOD[0], (3.0, np.nan, 5.0, 0.0))}, "at 0.1 s has AUV1 at y = nan"),
        ({"auvs": ((1.0, 2.0, 5.0, np.inf), GOOD[1])}, "has AUV0 at yaw = inf"),
        ({"auvs": (GOOD[0], (3.0, 204.0, 5.0, 0.0))}, "AUV1 200 m from where it was 0.1 s before"),
        ({"auvs": (GOOD[0], (3.0, 4.0, 210.0, 0.0))}, "AUV1 205 m from where it was"),
        ({"auvs": (GOOD[0], (3.0, 4.0, -200.0, 0.0))}, "AUV1 at z = -200; AUVs must be in the sea"),
    ],
)
def test_answers_that_cannot_be_used_are_refused(answer: Any, told: str) -> None:
    """One message names the instant, the vehicle, what was given and what is needed."""
    held = poses(Wrong(answer))
    with pytest.raises(ValueError, match=told) as error:
        held.advance(0.05)
    assert "0.1 s" in str(error.value)


def test_a_program_that_stands_elsewhere_in_time_is_refused() -> None:
    """Its own clock tells that it overshot, or that it goes backwards for a second mission."""
    with pytest.raises(ValueError, match=r"asked for 0\.1 s, and its own `time` is 0\.12 s"):
        poses(Wrong({"auvs": GOOD}, stands_at=0.12)).advance(0.1)
    used = Moved(lambda time: (0.0, 0.0, 5.0, 0.0))
    used.time = 12.5  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match=r"asked for 0 s, and its own `time` is 12\.5 s"):
        poses(used)


@pytest.mark.parametrize("step", [0.0, -0.1, np.nan, np.inf, 1e-4, "0.1"])
def test_a_step_that_is_none_is_refused(step: Any) -> None:
    """Steps are numbers of seconds, and no shorter than is good for anything."""
    with pytest.raises(ValueError, match="pose_step_s must be a number of seconds"):
        poses(Moved(lambda time: (0.0, 0.0, 5.0, 0.0)), step)


def test_what_moves_nothing_is_refused() -> None:
    """A source is an object with the one verb."""
    with pytest.raises(ValueError, match=r"object .* has no method advance_to\(time\)"):
        poses(object())


def test_its_own_errors_are_its_own() -> None:
    """What the program raises comes out as it is; it must not be asked from within."""

    class Broken:
        def advance_to(self, time: float) -> Any:
            if time:
                held.advance(2.0)
            return {"auvs": GOOD}

    held = poses(Broken())
    with pytest.raises(RuntimeError, match="must not advance or look at the mission") as error:
        held.advance(1.0)
    [note] = error.value.__notes__
    assert note.startswith("The pose source raised this at ")
    assert note.endswith(", asked for 0.1 s.")
