"""Vehicles against outside trajectories, against a second writing of their equations, and the laws.

The second writing (`rates`) is plain numpy: full matrices, solved anew for each state, rigid body
on the velocity over ground, added mass and drag on the velocity through the water.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp  # type: ignore[import-untyped,unused-ignore]

from bindusbl_des import Scenario, Setup
from bindusbl_des.dynamics import (
    MODELS,
    Fleet,
    parameters,
    steady_speed,
    steady_turn,
    trajectory,
)

Floats = NDArray[np.float64]
REFERENCE = Path(__file__).parents[1] / "reference" / "dynamics"
DEGREE = np.pi / 180.0
FIELD = ("remus100", "bluerov2", "otter", "cybership2")
TRIM = 13.5 * 9.81 - 1025.0 * 9.81 * 0.0134  # N, weight less buoyancy of the BlueROV2
HOVER = [0.0, 0.0, -TRIM, 0.0, 0.0, 0.0]
STEP = {"otter": 0.02}  # s; the others take 0.05
TILT = (0.12, -0.07)  # m/s North and East, a current across everything


def differences(model: str, states: Floats, reference: Floats) -> tuple[float, float]:
    """Return how far two trajectories lie apart: position (m) and attitude (rad)."""
    apart = np.abs(states - reference)
    space = 3 if "z" in MODELS[model].states else 2
    return float(apart[:, :space].max()), float(apart[:, space : 6 if space == 3 else 3].max())


# ---------------------------------------------------------------- outside reference trajectories


@cache
def reference(name: str, model: str) -> tuple[Floats, Floats, Floats, Floats]:
    """Return times, commands, states and current of a reference trajectory."""
    lines = (REFERENCE / f"{name}.csv").read_text().splitlines()
    (current_line,) = [line for line in lines if line.startswith("# current")]
    current = np.array([float(x) for x in current_line.split("[")[2].split("]")[0].split(",")][:2])
    table = [line for line in lines if not line.startswith("#")]
    column = {title: k for k, title in enumerate(table[0].split(","))}
    rows = np.array([[float(x) for x in line.split(",")] for line in table[1:]])
    command_names = {
        "remus100": ("delta_r_cmd", "delta_s_cmd", "n_cmd_rpm"),
        "bluerov2": ("tau_X", "tau_Y", "tau_Z", "tau_K", "tau_M", "tau_N"),
        "otter": ("n1_cmd", "n2_cmd"),
        "cybership2": ("tau_u", "tau_v", "tau_r"),
    }[model.removesuffix("_pvs")]
    commands = rows[:, [column[c] for c in command_names]]
    return rows[:, 0], commands, rows[:, [column[s] for s in MODELS[model].states]], current


CASES = [
    ("remus_straight_1000rpm", "remus100"),
    ("remus_turn_rudder10_900rpm", "remus100"),
    ("remus_turn_rudder10_400rpm", "remus100"),
    ("remus_turn_rudder10_900rpm", "remus100_pvs"),
    ("asv_cs2_surge_step", "cybership2"),
    ("asv_cs2_yaw_step", "cybership2"),
    ("asv_cs2_drift_current", "cybership2"),
    ("otter3_step", "otter"),
    ("bluerov2_surge_step", "bluerov2"),
    ("bluerov2_yaw_step_while_surging", "bluerov2"),
]


@pytest.mark.parametrize(("name", "model"), CASES)
def test_a_vehicle_follows_its_reference_trajectory(name: str, model: str) -> None:
    """Every vehicle swims the published manoeuvre within 1 mm and 0.1 mrad at every instant."""
    times, commands, states, current = reference(name, model)
    step = STEP.get(model, 0.05)
    ours = trajectory(
        model, times, commands, current_m_per_s=current, initial=states[0], step_s=step
    )
    position, angle = differences(model, ours, states)
    assert position < 1e-3
    assert angle < 1e-4


def test_a_wrong_hull_misses_its_reference_trajectory() -> None:
    """One per cent more cross-flow drag already shows as centimetres: the comparison can fail."""
    times, commands, states, _ = reference("remus_turn_rudder10_900rpm", "remus100")
    stiffer = {"cross_flow_drag": 1.1977288 * 1.01}
    ours = trajectory("remus100", times, commands, initial=states[0], overrides=stiffer)
    assert differences("remus100", ours, states)[0] > 0.01


# ---------------------------------------------------------------- the equations written again


def cross(a: Floats) -> Floats:
    """Return the matrix S(a) with S(a) b = a x b."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0.0]])


def momentum_rate(mass: Floats, nu: Floats) -> Floats:
    """Return C(nu) nu for any 6x6 mass matrix, by Kirchhoff's equations."""
    h = mass @ nu
    return np.concatenate(
        [np.cross(nu[3:], h[:3]), np.cross(nu[3:], h[3:]) + np.cross(nu[:3], h[:3])]
    )


def rotation(phi: float, theta: float, psi: float) -> Floats:
    """Return the matrix from body axes to North, East, Down."""
    about_x = np.array([[1, 0, 0], [0, np.cos(phi), -np.sin(phi)], [0, np.sin(phi), np.cos(phi)]])
    about_y = np.array(
        [[np.cos(theta), 0, np.sin(theta)], [0, 1, 0], [-np.sin(theta), 0, np.cos(theta)]]
    )
    about_z = np.array([[np.cos(psi), -np.sin(psi), 0], [np.sin(psi), np.cos(psi), 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


def attitude_rates(phi: float, theta: float, omega: Floats) -> Floats:
    """Return the Euler angle rates, by solving omega = T^-1 rates."""
    inverse = np.array(
        [
            [1, 0, -np.sin(theta)],
            [0, np.cos(phi), np.cos(theta) * np.sin(phi)],
            [0, -np.sin(phi), np.cos(theta) * np.cos(phi)],
        ]
    )
    return np.linalg.solve(inverse, omega)


def strips(v: float, r: float, length: float) -> tuple[float, float]:
    """Return the sums of |w|w dx and x|w|w dx over 21 stations."""
    x = np.linspace(-length / 2, length / 2, 21)
    w = v + x * r
    return float((abs(w) * w).sum() * length / 20), float((x * abs(w) * w).sum() * length / 20)


def diving_body(
    state: Floats, current: Floats, rigid: Floats, added: Floats, forces: Callable[..., Floats]
) -> Floats:
    """Return the twelve rates of a 6-DOF body; `forces(nu_r, gravity direction)` are all others."""
    turn = rotation(*state[3:6])
    nu = state[6:12]
    water = turn.T @ np.array([*current, 0.0])
    nu_c = np.concatenate([water, np.zeros(3)])
    nu_c_rate = np.concatenate([-np.cross(nu[3:], water), np.zeros(3)])
    down = turn.T @ np.array([0.0, 0.0, 1.0])
    load = forces(nu - nu_c, down) - momentum_rate(rigid, nu) + added @ nu_c_rate
    rates = np.linalg.solve(rigid + added, load)
    return np.concatenate([turn @ nu[:3], attitude_rates(state[3], state[4], nu[3:]), rates])


def bluerov2_rates(state: Floats, tau: Floats, current: Floats) -> Floats:
    """Return the rates of the BlueROV2, added mass by Kirchhoff, weights as vectors at points."""
    rigid = np.diag([13.5, 13.5, 13.5, 0.26, 0.23, 0.37])
    added = np.diag([6.36, 7.12, 18.68, 0.189, 0.135, 0.222])
    linear = np.array([13.7, 0, 33.0, 0, 0.8, 0])
    quadratic = np.array([141.0, 217.0, 190.0, 1.19, 0.47, 1.5])

    def forces(nu_r: Floats, down: Floats) -> Floats:
        lift = -1025.0 * 9.81 * 0.0134 * down
        weights = np.concatenate([13.5 * 9.81 * down + lift, np.cross([0, 0, -0.01], lift)])
        drag = (linear + quadratic * abs(nu_r)) * nu_r
        return np.asarray(tau + weights - drag - momentum_rate(added, nu_r))

    return diving_body(state, current, rigid, added, forces)


def remus100_rates(state: Floats, command: Floats, current: Floats) -> Floats:
    """Return the rates of the REMUS-100, from its printed numbers and full matrices."""
    m, zg, rho = 31.029385, 0.02, 1026.0
    lever = np.eye(6)
    lever[:3, 3:] = cross(np.array([0, 0, zg])).T
    at_cg = np.diag([m, m, m, 0.11201608, 4.02776932, 4.02776932])
    rigid = lever.T @ at_cg @ lever
    added = np.diag([0.838909, 29.437637, 29.437637, 0.033605, 3.426210, 3.426210])
    mass = (rigid + added).diagonal()

    def coriolis_of_water(nu_r: Floats) -> Floats:
        c = np.zeros((6, 6))
        c[:3, 3:] = c[3:, :3] = -cross(added[:3, :3] @ nu_r[:3])
        c[3:, 3:] = -cross(added[3:, 3:] @ nu_r[3:])
        for row, column in ((4, 0), (0, 4), (4, 2), (2, 4), (5, 0), (0, 5), (5, 1), (1, 5)):
            c[row, column] = 0.0
        return c @ nu_r

    def forces(nu_r: Floats, down: Floats) -> Floats:
        u, v, w = nu_r[:3]
        speed = np.linalg.norm(nu_r[:3])
        stiffness = m * 9.81 * zg
        damping = mass / [20, 20, 20, 1, 1, 1.0]
        damping[:2] *= np.exp(-3 * speed)
        damping[3] *= 2 * 0.3 * np.sqrt(stiffness / mass[3])
        damping[4] *= 2 * 0.8 * np.sqrt(stiffness / mass[4])
        area, aspect, alpha = 0.2128, 0.19**2 / 0.2128, np.arctan2(w, u)
        lift = np.pi * aspect / (1 + np.sqrt(1 + (aspect / 2) ** 2)) * alpha
        drag = 0.42 * np.pi * 0.095**2 / area + lift**2 / (np.pi * 0.7 * aspect)
        dynamic = 0.5 * rho * speed**2 * area
        surge = dynamic * (-np.cos(alpha) * drag + np.sin(alpha) * lift)
        heave = dynamic * (-np.sin(alpha) * drag - np.cos(alpha) * lift)
        push, twist = strips(v, nu_r[5], 1.6)
        strip = 0.5 * rho * 0.19 * 1.1977288
        hull = np.array([surge, -strip * push, heave, 0, 0, -strip * twist])
        rudder, plane, n = state[12], state[13], state[14] / 60
        fin = 0.5 * rho * 2 * 0.00665
        side, dive = -fin * (u * u + v * v) * 0.5 * rudder, -fin * (u * u + w * w) * 0.7 * plane
        slow = 0.944 * speed / 0.14 * abs(n) / 0.6632 if n > 0 else 0.0
        thrust = 0.9 * rho * 0.14**4 * (0.4566 * n * abs(n) + (0.1798 - 0.4566) * slow)
        torque = 0.1 * rho * 0.14**5 * (0.07 * n * abs(n) + (0.0312 - 0.07) * slow)
        tail = np.array(
            [thrust + side * rudder + dive * plane, side, dive, torque, 0.8 * dive, -0.8 * side]
        )
        hanging = np.concatenate([np.zeros(3), np.cross([0, 0, zg], m * 9.81 * down)])
        return np.asarray(hull + tail + hanging - damping * nu_r - coriolis_of_water(nu_r))

    limits = np.array([15 * DEGREE, 15 * DEGREE, 1525.0])
    follow = (np.clip(command, -limits, limits) - state[12:]) / [0.1, 0.1, 1.0]
    return np.concatenate([diving_body(state, current, rigid, added, forces), follow])


def surface_craft(
    state: Floats, current: Floats, rigid: Floats, added: Floats, forces: Callable[..., Floats]
) -> Floats:
    """Return the six rates of a 3-DOF craft: C_RB on nu, C_A on nu_r, one matrix solve."""
    turn = rotation(0.0, 0.0, state[2])
    nu = state[3:6]
    water = turn.T @ np.array([*current, 0.0])
    nu_r = nu - water
    nu_c_rate = nu[2] * np.array([water[1], -water[0], 0.0])

    def coriolis(mass: Floats, velocity: Floats) -> Floats:
        side, ahead = mass[1] @ velocity, mass[0] @ velocity
        return np.array([[0, 0, -side], [0, 0, ahead], [side, -ahead, 0]]) @ velocity

    load = forces(nu_r) - coriolis(rigid, nu) - coriolis(added, nu_r) + added @ nu_c_rate
    return np.concatenate([turn @ nu, np.linalg.solve(rigid + added, load)])


def cybership2_rates(state: Floats, tau: Floats, current: Floats) -> Floats:
    """Return the rates of CyberShip II with the published derivatives."""
    rigid = np.array([[23.8, 0, 0], [0, 23.8, 23.8 * 0.046], [0, 23.8 * 0.046, 1.76]])

    def forces(nu_r: Floats) -> Floats:
        u, v, r = nu_r
        surge = -0.72253 * u - 1.32742 * abs(u) * u - 5.86643 * u**3
        sway = -0.88965 * v - 36.47287 * abs(v) * v - 0.805 * abs(r) * v
        sway += -7.25 * r - 0.845 * abs(v) * r - 3.45 * abs(r) * r
        yaw = 0.0313 * v + 3.95645 * abs(v) * v + 0.13 * abs(r) * v
        yaw += -1.9 * r + 0.08 * abs(v) * r - 0.75 * abs(r) * r
        return np.asarray(tau + np.array([surge, sway, yaw]))

    return surface_craft(state, current, rigid, np.diag([2.0, 10.0, 1.0]), forces)


def otter_rates(state: Floats, command: Floats, current: Floats) -> Floats:
    """Return the rates of the Otter with its printed numbers."""
    rigid = np.array([[80, 0, 0], [0, 80, 12.25], [0, 12.25, 16.977881]])
    port, starboard = ((0.01108 if n > 0 else 0.006445) * n * abs(n) for n in (state[6], state[7]))

    def forces(nu_r: Floats) -> Floats:
        u, v, r = nu_r
        push, twist = strips(v, r, 2.0)
        strip = 0.5 * 1026 * 0.195122 * 1.0041845
        drag = np.array([77.554432 * u, 162.5 * v, 42.65145 * r + 426.5145 * abs(r) * r])
        thrust = np.array([port + starboard, 0, 0.395 * (port - starboard)])
        return np.asarray(thrust - drag - strip * np.array([0, push, twist]))

    craft = surface_craft(state, current, rigid, np.diag([5.5, 82.5, 25.673569]), forces)
    return np.concatenate([craft, (np.clip(command, -101.737, 103.931) - state[6:]) / 0.1])


def otter_on_waves_rates(state: Floats, command: Floats) -> Floats:
    """Return the rates of the Otter in six degrees of freedom, PVS word for word, still water."""
    lever = np.eye(6)
    lever[:3, 3:] = cross(np.array([0.153125, 0, -0.246875])).T
    at_cg = np.diag([80.0, 80, 80, 16.67891961, 21.51669922, 15.10209961])
    at_cg[3, 5] = at_cg[5, 3] = 2.51665039
    rigid = lever.T @ at_cg @ lever
    added = np.diag([5.5, 82.5, 55, 3.33578392, 17.21335937, 25.67356934])
    linear = [77.55443235, 162.5, 605.40388378, 62.06541638, 266.59700215, 42.6514502]
    stiffness = np.diag([0, 0, 7541.4375, 967.26619227, 2743.3704878, 0])
    stiffness[2, 4] = stiffness[4, 2] = 1508.2875
    t = 0.01108 * state[12:14] * abs(state[12:14])

    def forces(nu: Floats, down: Floats) -> Floats:
        push, twist = strips(nu[1], nu[5], 2.0)
        strip = 0.5 * 1026 * 0.19512195 * 1.00418447
        payload = np.concatenate([245.25 * down, np.cross([0.05, 0, -0.35], 245.25 * down)])
        tau = np.array([t.sum(), 0, 0, 0, 0, 0.395 * (t[0] - t[1])])
        tau[5] -= 426.514502 * abs(nu[5]) * nu[5] + strip * twist
        tau[1] -= strip * push
        return np.asarray(
            tau + payload - linear * nu - momentum_rate(added, nu) - stiffness @ state[:6]
        )

    body = diving_body(state, np.zeros(2), rigid, added, forces)
    return np.concatenate([body, (command - state[12:]) / 0.1])


def test_the_second_writing_rides_an_outside_trajectory() -> None:
    """The numpy bodies that judge the compiled ones are themselves within 1 mm of outside data."""
    lines = (REFERENCE / "asv_otter_step.csv").read_text().splitlines()
    rows = np.array([line.split(",") for line in lines if line[0].isdigit()], dtype=float)
    turn, rows = rows[rows[:, 0] <= 40.0], rows[rows[:, 0] <= 60.0]
    state, path = np.zeros(14), [np.zeros((1, 14))]
    for times, command in ((turn[:, 0], [60, 60]), (rows[len(turn) - 1 :, 0], [70, 50])):
        run = solve_ivp(
            lambda _, y, command=command: otter_on_waves_rates(y, np.array(command)),
            times[[0, -1]], state, "DOP853", times, rtol=1e-9, atol=1e-10,
        )  # fmt: skip
        state = run.y[:, -1]
        path.append(run.y.T[1:])
    assert np.abs(np.concatenate(path)[:, :6] - rows[:, 1:7]).max() < 1e-6


RATES: dict[str, Callable[[Floats, Floats, Floats], Floats]] = {
    "remus100": remus100_rates,
    "bluerov2": bluerov2_rates,
    "otter": otter_rates,
    "cybership2": cybership2_rates,
}
# how far from zero random states and commands lie, and how exactly the printed numbers are printed
SPREAD: dict[str, tuple[list[float], list[float], float]] = {
    "remus100": ([9, 9, 9, 1, 1.2, 3, 2, 1, 1, 1, 1, 1, 0.3, 0.3, 1600], [0.4, 0.4, 2000], 3e-6),
    "bluerov2": ([9, 9, 9, 2, 1.4, 3, 1, 1, 1, 2, 2, 2], [90, 90, 100, 20, 15, 20], 1e-12),
    "otter": ([9, 9, 3, 3, 1, 1, 110, 110], [150, 150], 1e-12),
    "cybership2": ([9, 9, 3, 0.6, 0.3, 0.5], [2, 2, 2], 1e-12),
}


@pytest.mark.parametrize("model", FIELD)
def test_the_equations_agree_with_their_second_writing(model: str) -> None:
    """In 500 random seas a step moves a vehicle as full matrices, solved anew, do."""
    random, step = np.random.default_rng(7), 1e-3
    kind = MODELS[model]
    state_spread, command_spread, tolerance = SPREAD[model]
    for _ in range(500):
        state = random.uniform(-1, 1, len(kind.states)) * state_spread
        command = random.uniform(-1, 1, len(kind.commands)) * command_spread
        current = random.uniform(-0.5, 0.5, 2)
        ours = trajectory(
            model, [0.0, step], [command] * 2, initial=state, current_m_per_s=current, step_s=step
        )[1]
        theirs, first = runge_kutta(model, state, command, current, step), ours - state
        rounding = 1e-15 * np.abs(state).max()
        assert np.abs(first - theirs).max() < 2 * tolerance * np.abs(theirs).max() + 4 * rounding


def runge_kutta(model: str, state: Floats, command: Floats, current: Floats, step: float) -> Floats:
    """Return how far a step of fourth order (s) moves a state."""

    def rates(at: Floats) -> Floats:
        return RATES[model](at, command, current)

    one = rates(state)
    two = rates(state + step / 2 * one)
    three = rates(state + step / 2 * two)
    four = rates(state + step * three)
    return np.asarray(step / 6 * (one + 2 * two + 2 * three + four))


# ---------------------------------------------------------------- manoeuvres nobody has published

ZIGZAG = [(0.0, (0, 0, 900)), (20.013, (10, 0, 900)), (30.37, (-10, 0, 900)), (45.1, (10, 0, 900))]
DIVE = [(0.0, (0, 0, 1000)), (10.004, (0, 4, 1000)), (18.3, (0, -5, 1000)), (31.77, (0, 0, 1000))]
BOTH = [(0.0, (0, 0, 1200)), (7.7, (12, 3, 1200)), (25.01, (-6, -4, 700)), (40.0, (3, 1, 1525))]
MANOEUVRES: list[tuple[str, str, tuple[float, float], list[tuple[float, Any]]]] = [
    *(
        ("remus100", title, current, [(t, (r * DEGREE, s * DEGREE, n)) for t, (r, s, n) in plan])
        for title, plan in (("zig-zag", ZIGZAG), ("dive", DIVE), ("corkscrew", BOTH))
        for current in ((0.0, 0.0), (0.25, -0.3))
    ),
    ("bluerov2", "hover dance", TILT, [
        (0.0, (20, 5, -TRIM + 8, 0.3, 0, 0.2)), (6.613, (-15, 12, -TRIM, 0, 0.5, -0.4)),
        (14.2, (5, -20, -TRIM - 10, -0.2, -0.5, 0)), (25.5, HOVER)]),
    ("bluerov2", "loaded turn", (0.0, 0.2), [
        (0.0, (30, 0, -TRIM, 0, 0, 0.3)), (12.34, (30, 0, -TRIM + 5, 0, 0.2, -0.5))]),
    ("otter", "reversals", (0.3, 0.1), [
        (0.0, (70, 70)), (15.013, (-60, 60)), (22.2, (-90, -90)), (30.007, (120, 40))]),
    ("cybership2", "crabbing", (0.1, 0.05), [
        (0.0, (1.5, 0, 0.1)), (12.03, (-1, 1, -0.3)), (30.7, (2, -1, 0.5))]),
]  # fmt: skip
UNTIL = 60.0  # s


def exact(model: str, current: tuple[float, float], plan: Any, times: Floats) -> Floats:
    """Return the states at `times` by DOP853 on the second writing, restarted at each command.

    A hundredth of these tolerances moves no manoeuvre by 0.01 mm or 1e-6 rad.
    """
    state = np.zeros(len(MODELS[model].states))
    rows = [state[None]]
    ends = [*(begin for begin, _ in plan[1:]), UNTIL]
    for (begin, command), end in zip(plan, ends, strict=True):
        inside = times[(times > begin) & (times <= end)]
        path = solve_ivp(
            lambda _, y, command=command: RATES[model](y, np.array(command), np.array(current)),
            (begin, end), state, "DOP853", np.unique([*inside, end]), rtol=1e-7, atol=1e-8,
        )  # fmt: skip
        rows.append(path.y.T[: len(inside)])
        state = path.y[:, -1]
    return np.concatenate(rows)


@pytest.mark.parametrize(
    ("model", "title", "current", "plan"),
    [
        pytest.param(
            *row,
            id="-".join(map(str, (*row[:2], row[2][0]))),
            marks=[pytest.mark.slow] if row[1] in ("zig-zag", "dive", "loaded turn") else [],
        )
        for row in MANOEUVRES
    ],
)
def test_a_manoeuvre_is_swum_as_the_exact_solution_swims_it(
    model: str, title: str, current: tuple[float, float], plan: Any
) -> None:
    """Commands at odd instants, currents and reversals: within 1 mm and 0.1 mrad of DOP853."""
    times = np.unique([*np.arange(0.0, UNTIL + 0.1, 0.73), *(begin for begin, _ in plan)])
    held = np.searchsorted([begin for begin, _ in plan], times, side="right") - 1
    commands = np.array([plan[k][1] for k in held], dtype=float)
    step = STEP.get(model, 0.05)
    ours = trajectory(model, times, commands, current_m_per_s=current, step_s=step)
    position, angle = differences(model, ours, exact(model, current, plan, times))
    assert position < 1e-3
    assert angle < 1e-4


# ---------------------------------------------------------------- laws of the sea

CRUISE: dict[str, list[float]] = {
    "remus100": [6 * DEGREE, 2 * DEGREE, 900.0],
    "bluerov2": [18.0, 6.0, -TRIM + 3.0, 0.2, 0.1, 0.15],
    "otter": [70.0, 50.0],
    "cybership2": [1.0, 0.5, 0.2],
}


def moving(model: str, speed: float = 0.5) -> Floats:
    """Return a state of a vehicle under way, its attitude and turning not zero."""
    state = np.zeros(len(MODELS[model].states))
    names = MODELS[model].states
    values = {
        "psi": 0.7,
        "u": speed,
        "v": 0.1,
        "r": 0.05,
        "z": 10.0,
        "phi": 0.05,
        "theta": -0.04,
        "w": 0.03,
        "q": 0.02,
    }
    for name, value in values.items():
        if name in names:
            state[names.index(name)] = value
    return state


def drifting(model: str, current: tuple[float, float], step: float) -> float:
    """Return how far (m) a run in a current ends from the still-water run carried along."""
    times = np.linspace(0.0, 60.0, 31)
    commands = np.tile(CRUISE[model.removesuffix("_pvs")], (31, 1))
    still, carried = moving(model), moving(model)
    space = 3 if "z" in MODELS[model].states else 2
    turn = rotation(*still[3:6]) if space == 3 else rotation(0.0, 0.0, still[2])
    water = turn.T @ np.array([*current, 0.0])
    first = MODELS[model].velocity
    carried[first] += water[:space]
    a = trajectory(model, times, commands, initial=still, step_s=step)
    b = trajectory(model, times, commands, initial=carried, current_m_per_s=current, step_s=step)
    b[:, :2] -= np.outer(times, current)
    return float(np.abs(a[:, :space] - b[:, :space]).max())


@pytest.mark.parametrize("model", FIELD)
def test_a_uniform_current_only_carries_a_vehicle_along(model: str) -> None:
    """Seen from the drifting water, a vehicle swims as in still water (Galileo)."""
    assert drifting(model, (0.3, -0.2), 0.01) < 1e-6


def test_the_verbatim_pvs_form_feels_the_current_wrongly() -> None:
    """The PVS form, which mixes ground and water speed, misses the drifting test by metres."""
    assert drifting("remus100_pvs", (0.3, -0.2), 0.01) > 1.0


MIRRORED_STATES = {"y", "phi", "psi", "v", "p", "r", "delta_r"}
MIRRORED_COMMANDS = {"Y", "K", "N", "delta_r", "tau_v", "tau_r"}


@pytest.mark.parametrize("model", FIELD)
def test_port_mirrors_starboard(model: str) -> None:
    """A vehicle told the mirrored command swims the mirrored track, bit for bit.

    The REMUS does so only without its propeller's torque, which rolls it to one side.
    """
    kind = MODELS[model]
    overrides = {"torque_felt_by_hull": 0.0} if model == "remus100" else {}
    flip = np.array([-1.0 if name in MIRRORED_STATES else 1.0 for name in kind.states])
    sign = np.array([-1.0 if name in MIRRORED_COMMANDS else 1.0 for name in kind.commands])
    times = np.linspace(0.0, 40.0, 21)
    commands = np.tile(CRUISE[model], (21, 1))
    mirrored = commands[:, ::-1] if model == "otter" else commands * sign
    swap = [0, 1, 2, 3, 4, 5, 7, 6] if model == "otter" else list(range(len(kind.states)))
    start = moving(model)
    one = trajectory(model, times, commands, initial=start, overrides=overrides)
    other = trajectory(model, times, mirrored, initial=(start * flip)[swap], overrides=overrides)
    assert np.abs(one[:, 1]).max() > 1.0
    assert np.array_equal(one, (other * flip)[:, swap])


def test_propeller_torque_breaks_the_mirror() -> None:
    """With its propeller's torque the REMUS turns a little differently to port and starboard."""
    port = steady_turn("remus100", [-10 * DEGREE, 0, 900]).radius_m
    starboard = steady_turn("remus100", [10 * DEGREE, 0, 900]).radius_m
    assert 0.0 < abs(port - starboard) < 0.5


def energy(model: str, states: Floats) -> Floats:
    """Return kinetic and potential energy (J) in still water, one number per row."""
    hull = MODELS[model].coefficients(parameters(model))
    if model == "otter":
        nu, mass = states[:, 3:6], np.array([[85.5, 0, 0], [0, 162.5, 12.25], [0, 12.25, 42.65145]])
        return 0.5 * np.asarray(np.einsum("ti,ij,tj->t", nu, mass, nu))
    righting: Floats = np.cos(states[:, 3]) * np.cos(states[:, 4])
    if model == "bluerov2":
        sinking, moment = TRIM, 1025.0 * 9.81 * 0.0134 * 0.01
        mass = np.diag([hull.m1, hull.m2, hull.m3, hull.m4, hull.m5, hull.m6])
    else:
        m, sinking, moment = 31.029385, 0.0, 31.029385 * 9.81 * 0.02
        mass = np.diag([31.868294, 60.467022, 60.467022, 0.158033, 7.466391, 7.453979])
        mass[0, 4] = mass[4, 0] = m * 0.02
        mass[1, 3] = mass[3, 1] = -m * 0.02
    nu = states[:, 6:12]
    kinetic: Floats = 0.5 * np.asarray(np.einsum("ti,ij,tj->t", nu, mass, nu))
    return kinetic - sinking * states[:, 2] - moment * righting


@pytest.mark.parametrize("model", ["remus100", "bluerov2", "otter"])
def test_a_vehicle_left_alone_only_loses_energy(model: str) -> None:
    """Without thrust the water takes energy at every instant and never gives any."""
    start = moving(model, 1.0)
    times = np.linspace(0.0, 30.0, 301)
    idle = np.zeros((301, len(MODELS[model].commands)))
    states = trajectory(model, times, idle, initial=start, step_s=0.02)
    spent = np.diff(energy(model, states))
    assert spent.max() < 1e-6 * abs(spent).max()
    assert spent.min() < -0.01


def test_cybership_left_alone_comes_to_rest() -> None:
    """Its measured cross drags are not passive instant by instant, but all motion dies."""
    states = trajectory("cybership2", [0, 600], np.zeros((2, 3)), initial=moving("cybership2"))
    assert np.abs(states[1, 3:]).max() < 1e-3


def test_a_quiet_rov_floats_up_at_its_terminal_speed() -> None:
    """Excess buoyancy of 2.3 N lifts the idle BlueROV2 where linear and square drag balance it."""
    rise = (-33 + np.sqrt(33**2 + 4 * 190 * -TRIM)) / (2 * 190)
    assert steady_speed("bluerov2", np.zeros(6)) == pytest.approx(rise, rel=1e-6)


def test_coefficients_that_no_vehicle_has_are_a_mistake() -> None:
    """Thrust of 30 MN: the motion grows without end, and it is no speed that is to be less."""
    vehicle = {"model": "bluerov2", "thruster_limit_n": 3.04e7}
    scenario = Scenario(name="x", auvs={"vehicle": vehicle, "speed_m_per_s": 0.3})
    with pytest.raises(ValueError, match=r"grows without end.* give coefficients") as told:
        Setup(scenario).plans  # noqa: B018 (it is asked for)
    assert "ask for less" not in str(told.value)


def test_a_ballasted_rov_hangs_still() -> None:
    """A BlueROV2 as heavy as the water it displaces neither rises nor sinks."""
    ballast = {"mass_kg": 1025.0 * 0.0134}
    states = trajectory("bluerov2", [0, 60], np.zeros((2, 6)), overrides=ballast)
    assert np.abs(states[1]).max() < 1e-9


# ---------------------------------------------------------------- what the tables of handbooks say


@pytest.mark.parametrize(
    ("revolutions", "speed"),
    [(366, 0.601), (500, 0.831), (620, 1.035), (800, 1.338), (915, 1.532), (1000, 1.674),
     (1525, 2.554)],
)  # fmt: skip
def test_remus_speed(revolutions: float, speed: float) -> None:
    """A REMUS at so many revolutions a minute makes this speed."""
    assert steady_speed("remus100", [0, 0, revolutions]) == pytest.approx(speed, abs=6e-4)


@pytest.mark.parametrize(
    ("time_constant", "revolutions", "radii"),
    [
        (1, 366, (74.5, 41.6, 29.9)), (1, 620, (55.5, 32.2, 23.6)), (1, 915, (47.1, 28.0, 20.8)),
        (2, 366, (51.2, 30.0, 22.2)), (2, 620, (42.6, 25.7, 19.3)), (2, 915, (38.7, 23.7, 17.9)),
        (5, 366, (38.3, 23.5, 17.8)), (5, 620, (35.4, 22.0, 16.8)), (5, 915, (33.9, 21.3, 16.3)),
        (10, 366, (34.2, 21.4, 16.3)), (10, 620, (33.0, 20.8, 15.9)), (10, 915, (32.4, 20.5, 15.7)),
    ],
)  # fmt: skip
def test_remus_turning_circle(
    time_constant: float, revolutions: float, radii: tuple[float, ...]
) -> None:
    """Rudder 5, 10 and 15 degrees give these circles, by how strongly yaw is damped."""
    for rudder, radius in zip((5, 10, 15), radii, strict=True):
        turn = steady_turn(
            "remus100",
            [rudder * DEGREE, 0, revolutions],
            overrides={"yaw_time_constant_s": time_constant},
        )
        assert turn.radius_m == pytest.approx(radius, abs=0.06)
        assert turn.yaw_rate_rad_per_s > 0


@pytest.mark.parametrize(
    ("propellers", "speed", "radius"),
    [
        ((62, 58), 1.03, 20.3),
        ((65, 55), 1.03, 12.0),
        ((70, 50), 1.05, 8.25),
        ((100, 40), 1.59, 5.8),
    ],
)
def test_otter_turning_circle(propellers: tuple[int, int], speed: float, radius: float) -> None:
    """The Otter turns to starboard on these circles when the port propeller runs faster."""
    turn = steady_turn("otter", propellers, step_s=0.02)
    assert turn.speed_m_per_s == pytest.approx(speed, abs=6e-3)
    assert turn.radius_m == pytest.approx(radius, abs=0.05)
    assert turn.yaw_rate_rad_per_s > 0


def test_otter_spins_almost_on_the_spot() -> None:
    """Propellers against each other turn the Otter at 0.19 rad/s on a circle of 1.2 m."""
    turn = steady_turn("otter", [60, -60], step_s=0.02)
    assert turn.radius_m == pytest.approx(1.2, abs=0.05)
    assert turn.yaw_rate_rad_per_s == pytest.approx(0.19, abs=0.005)


@pytest.mark.parametrize("speed", [40, 60, 80, 100])
def test_otter_speed(speed: float) -> None:
    """Her drag is linear: both propellers at n rad/s give 2 k n^2 / 77.554 m/s."""
    expected = 2 * 0.01108 * speed**2 / 77.554432
    assert steady_speed("otter", [speed, speed], step_s=0.02) == pytest.approx(expected, rel=1e-5)


def test_cybership_speed() -> None:
    """CyberShip II makes 0.511 m/s under 1.5 N and ends on no circle."""
    assert steady_speed("cybership2", [1.5, 0, 0]) == pytest.approx(0.511, abs=5e-4)
    assert steady_turn("cybership2", [1.5, 0, 0]).radius_m == np.inf


@pytest.mark.parametrize(
    ("thrust", "surge", "sway", "heave"),
    [(5, 0.146, 0.152, 0.097), (10, 0.222, 0.215, 0.158), (20, 0.331, 0.304, 0.249),
     (30, 0.415, 0.372, 0.320), (40, 0.486, 0.429, 0.380), (60, 0.606, 0.526, 0.482),
     (86, 0.734, 0.630, 0.592), (104.6, 0.814, 0.694, 0.660)],
)  # fmt: skip
def test_bluerov_speed(thrust: float, surge: float, sway: float, heave: float) -> None:
    """Thrust along each axis, weight trimmed off, gives these speeds."""
    for axis, speed in enumerate((surge, sway, heave)):
        command = np.array(HOVER)
        command[axis] += thrust
        assert steady_speed("bluerov2", command) == pytest.approx(speed, abs=6e-4)


@pytest.mark.parametrize(("moment", "radius"), [(0.05, 2.3), (0.2, 1.45), (0.5, 1.0), (1, 0.72)])
def test_bluerov_turning_circle(moment: float, radius: float) -> None:
    """Under 59 N ahead these yaw moments hold the BlueROV2 on these circles."""
    turn = steady_turn("bluerov2", [59, 0, -TRIM, 0, 0, moment])
    assert turn.radius_m == pytest.approx(radius, abs=0.015)


@pytest.mark.parametrize(("moment", "rate"), [(0.1, 15), (0.5, 33), (1, 47), (2, 66)])
def test_bluerov_yaw_rate(moment: float, rate: float) -> None:
    """Hovering, these yaw moments (N m) spin the BlueROV2 at so many degrees a second."""
    turn = steady_turn("bluerov2", [0, 0, -TRIM, 0, 0, moment])
    assert turn.yaw_rate_rad_per_s / DEGREE == pytest.approx(rate, abs=0.5)


# ---------------------------------------------------------------- steps, looks and commands


@pytest.mark.parametrize("model", FIELD)
def test_looking_changes_nothing(model: str) -> None:
    """A fleet watched at every tick and at odd instants swims bit for bit as one left alone."""
    random = np.random.default_rng(3)
    told = np.sort(random.uniform(0.0, 30.0, 8))
    looks = np.sort(np.concatenate([random.uniform(0.0, 30.0, 200), np.arange(601) * 0.05, told]))
    rows = random.uniform(0.2, 1.0, (8, len(CRUISE[model]))) * CRUISE[model]
    start = np.tile(moving(model), (3, 1))
    first = np.tile(CRUISE[model], (3, 1))

    def guided(instants: Floats) -> Floats:
        fleet = Fleet(model, start, commands=first, current_m_per_s=TILT)
        waiting = list(enumerate(told))
        for instant in [*instants, 31.234]:
            while waiting and waiting[0][1] <= instant:
                k, when = waiting.pop(0)
                fleet.command(when, k % 3, rows[k])
            final = fleet.at(instant)
        return final

    watched, alone = guided(looks), guided(np.array([]))
    assert np.array_equal(watched, alone)
    assert not np.array_equal(alone[0], alone[1])


def test_a_fleet_told_at_once_is_told_as_one_by_one() -> None:
    """Commanding all vehicles at an instant is commanding each of them then."""
    rows = [[60.0, 60.0], [70.0, 50.0]]
    together, singly = Fleet("otter", np.zeros((2, 8))), Fleet("otter", np.zeros((2, 8)))
    together.command_all(1.234, rows)
    for vehicle, row in enumerate(rows):
        singly.command(1.234, vehicle, row)
    assert np.array_equal(together.at(20.0), singly.at(20.0))
    with pytest.raises(ValueError, match="otter: no vehicle 2 among 2"):
        singly.command(21.0, 2, rows[0])


def test_the_instants_asked_for_change_no_bit_of_a_trajectory() -> None:
    """Rows at common instants are identical whether few or many instants were asked for."""
    few = np.array([0.0, 7.013, 20.0, 33.3])
    many = np.unique([*few, *np.random.default_rng(5).uniform(0, 33, 300)])
    command = np.where(many < 7.013, 0.0, 0.1)
    row = np.stack([command, 0 * command, 900 + 0 * command], axis=1)
    chosen = np.isin(many, few)
    dense = trajectory("remus100", many, row)
    assert np.array_equal(dense[chosen], trajectory("remus100", few, row[chosen]))


@pytest.mark.parametrize("model", FIELD)
def test_half_the_step_is_within_a_millimetre(model: str) -> None:
    """Over 300 s the step moves no vehicle by a millimetre."""
    times = np.linspace(0.0, 300.0, 61)
    commands = np.tile(CRUISE[model], (61, 1))
    commands[20:40] *= 0.6
    step = STEP.get(model, 0.05)
    start = moving(model)
    coarse, fine = (
        trajectory(model, times, commands, initial=start, current_m_per_s=TILT, step_s=s)
        for s in (step, step / 2)
    )
    assert differences(model, coarse, fine)[0] < 1e-3


def test_a_reversing_otter_at_the_coarse_step_stays_within_centimetres() -> None:
    """At 0.05 s her propeller lag and reversals cost millimetres, as the handbook warns."""
    times = np.linspace(0.0, 300.0, 31)
    commands = np.tile([[70.0, 50.0], [-60.0, 60.0], [80.0, 80.0]], (11, 1))[:31]
    coarse, fine = (trajectory("otter", times, commands, step_s=s) for s in (0.05, 0.005))
    assert 1e-5 < differences("otter", coarse, fine)[0] < 2e-2


# ---------------------------------------------------------------- what goes wrong, and is said


def test_standing_on_end_is_said_with_its_time() -> None:
    """A BlueROV2 pitched up without end is stopped at 89 degrees, not integrated through."""
    command = [[0, 0, -TRIM, 0, 5.0, 0]] * 2
    said = r"bluerov2, vehicle 0, at .* s: pitch .* beyond \+-89"
    with pytest.raises(FloatingPointError, match=said) as caught:
        trajectory("bluerov2", [0, 60], command)
    assert 0.0 < caught.value.time_s < 5.0


def test_a_state_without_bounds_is_said_with_its_time() -> None:
    """An absurd force ends in an error that names the instant, not in a row of NaN."""
    absurd = np.zeros((2, 3))
    absurd[1, 0] = 1e308
    fleet = Fleet("cybership2", np.zeros((2, 6)), commands=absurd)
    with pytest.raises(FloatingPointError, match=r"cybership2, vehicle 1, at 0.05 s: the state"):
        fleet.at(1.0)


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"model": "remus10"}, r"unknown model 'remus10'; did you mean 'remus100'"),
    ({"times": [0, 1, 1]}, r"times\[2\] = 1.0 does not follow times\[1\] = 1.0"),
    ({"times": []}, r"times has shape \(0,\)"),
    ({"times": [0, np.nan, 2]}, r"times\[1\] is nan"),
    ({"commands": [[0, 0]] * 3}, r"commands has shape \(3, 2\), not \(3, 3\).*delta_r"),
    ({"commands": [[0, 0, 0]] * 2}, r"commands has shape \(2, 3\), not \(3, 3\)"),
    ({"commands": [[0, 0, 0], [0, np.nan, 0], [0, 0, 0]]}, r"commands\[1, delta_s\] is nan"),
    ({"initial": np.zeros(12)}, r"initial has shape \(12,\), not \(15,\)"),
    ({"initial": [np.inf] + [0] * 14}, r"initial\[x\] is inf"),
    ({"initial": [0, 0, 0, 0, 1.57] + [0] * 10}, r"starts at pitch 90.0 deg"),
    (
        {"current_m_per_s": (0.1, 0.0, 0.0)},
        r"current_m_per_s has shape \(3,\), not \(2,\): \[North, East\]",
    ),
    ({"step_s": 0.0}, r"step_s must be a finite number above zero"),
    ({"overrides": {"yaw_time_constant": 5}}, r"did you mean 'yaw_time_constant_s'.*allowed: leng"),
    ({"overrides": {"yaw_time_constant_s": 0}}, r"yaw_time_constant_s must be above zero"),
    ({"overrides": {"oswald_efficiency": 0}}, r"oswald_efficiency must be above zero"),
    ({"overrides": {"reference_area_fraction": 0}}, r"reference_area_fraction must be above zero"),
    ({"overrides": {"advance_at_speed": 0}}, r"advance_at_speed must be above zero"),
    ({"overrides": {"rudder_lift": np.nan}}, r"rudder_lift must be a finite number"),
    ({"overrides": {"diameter_m": 2.0}}, r"diameter_m 2.0 must be below length_m"),
    ({"overrides": {"cg_below_cb_m": -0.1}}, r"cg_below_cb_m -0.1 must not be negative"),
    ({"overrides": {"gravity_m_per_s2": -9.81}}, r"gravity_m_per_s2 must be above zero"),
]


@pytest.mark.parametrize(("change", "message"), WRONG, ids=[m[:30] for _, m in WRONG])
def test_a_wrong_question_is_answered_with_the_remedy(change: dict[str, Any], message: str) -> None:
    """Every argument that does not fit is named, with what would fit."""
    good: dict[str, Any] = {"model": "remus100", "times": [0, 1, 2], "commands": np.zeros((3, 3))}
    with pytest.raises(ValueError, match=message):
        trajectory(**{**good, **change})


def test_time_does_not_run_backwards() -> None:
    """Asking where a fleet was, before the boundary it has already passed, is refused."""
    fleet = Fleet("otter", np.zeros((1, 8)))
    fleet.at(10.0)
    with pytest.raises(ValueError, match=r"otter: time 9.9 s lies before 10.0 s"):
        fleet.at(9.9)
