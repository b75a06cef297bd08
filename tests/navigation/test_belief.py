"""Beliefs of who may be turned about an ASV: they lie on a circle."""

import numpy as np
import pytest

from bindusbl_des.core.navigation.belief import on_circle, turn_with


def test_a_place_that_its_own_array_turns_goes_on_a_circle_about_the_asv() -> None:
    """What no fix tells of stays what it is about, wherever the place is corrected to."""
    sd, asv, place, moved = 0.05, np.array([7.0, -3.0]), np.array([40.0, 5.0]), (1.5, -0.8)
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    sure = 0.01 * np.eye(3)
    mode = np.append(quarter @ (place - asv), 1.0)
    spread = sure + sd**2 * np.outer(mode, mode)
    turn_with(spread, 2, *moved)
    mode = np.append(quarter @ (place + moved - asv), 1.0)
    sheared = np.eye(3)
    sheared[:2, 2] = quarter @ moved
    expected = sheared @ sure @ sheared.T + sd**2 * np.outer(mode, mode)
    assert spread == pytest.approx(expected, abs=1e-12)


def test_an_ellipse_holds_what_lies_on_a_circle() -> None:
    """The second moments of a turned place about the one believed, by a million draws."""
    sd, reach = 0.1, np.array([30.0, 40.0])
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    mode = np.append(quarter @ reach, 1.0)
    spread = sd**2 * np.outer(mode, mode)
    xx, yy, xy = on_circle(spread, 2)
    assert on_circle(spread, 0) == (spread[0, 0], spread[1, 1], spread[0, 1])
    c = np.random.default_rng(5).normal(0.0, sd, 10**6)
    off = (np.cos(c) - 1.0)[:, None] * reach + np.sin(c)[:, None] * (quarter @ reach)
    radial = reach / np.hypot(*reach)
    found = np.array([[xx, xy], [xy, yy]])
    assert radial @ found @ radial == pytest.approx(((off @ radial) ** 2).mean(), rel=0.02)
    assert radial @ found @ radial > 0.1
