"""A run as data of a page: what is drawn, packed, and thinned where a mission is very long."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.setup import Setup
from ...support.arrays import Floats
from .envelope import error_envelope
from .gaps import intervals, latencies, shown_until
from .page import Packer
from .possible import fields
from .recording import FATES, UNREACHED, Recording

if TYPE_CHECKING:
    from .gaps import Service

# A page stays quick to open up to about so many numbers of each kind.
MOST_TRACK_POINTS = 120_000
MOST_PINGS = 60_000
MOST_RECEPTIONS = 150_000
MOST_PLAN_POINTS = 30_000

# Steps to which a page rounds: positions, what is told in the plots, times, angles.
CENTIMETRE, MILLIMETRE, TENTH_OF_MS, CENTIRADIAN = 0.01, 0.001, 1e-4, 0.01

OUTCOMES = ("heard", "lost", "collided", "in_flight")
FIX_OUTCOMES = ("delivered", "out_of_range", "in_flight", "lost", "collided", "blocked")


def run_data(mission: Recording, services: tuple["Service", ...], packer: Packer) -> dict[str, Any]:
    """Return what a page needs to draw and play a mission; its columns go into the packer."""
    scenario, acoustics = mission.scenario, mission.scenario.acoustics
    setup = mission.setup
    track_step = _step(mission.truth["x_m"].size, MOST_TRACK_POINTS)
    kept = _kept_pings(mission)
    return {
        "name": scenario.name,
        "duration": scenario.duration_s,
        **survey_data(setup),
        "hf": {"range": acoustics.hf.range_m, "reach": setup.horizontal_reach_m},
        "mf": {"range": acoustics.mf.range_m, "reach": setup.horizontal_mf_reach_m},
        "discs": {
            "hf": acoustics.hf.traits.ends_at_range,
            "mf": acoustics.mf.traits.ends_at_range,
        },
        "broadcasting": scenario.protocol.sends_frames,
        "fields": fields(mission, packer),
        "soundSpeed": setup.sound_speed_m_per_s,
        "pingLength": acoustics.hf.ping_s,
        "asvsPing": scenario.protocol.asvs_ping,
        "calls": _has_calls(mission),
        "round": float(np.median(np.diff(mission.rounds["started_at_s"])))
        if len(mission.rounds["round"]) > 1
        else scenario.duration_s,
        "fates": FATES,
        "outcomes": OUTCOMES,
        "time": packer.add(mission.times[::track_step], quantum=TENTH_OF_MS),
        "order": np.argsort(
            [-(auv["position_error_m"] or 0.0) for auv in mission.metrics.auvs]
        ).tolist(),
        "auvs": [_auv(mission, service, track_step, packer) for service in services],
        "asvs": [_asv(mission, asv, track_step, packer) for asv in range(scenario.asvs.count)],
        "pings": _pings(mission, kept, packer),
        "receptions": _receptions(mission, kept, packer),
        "fixes": _fixes(mission, packer),
        "broadcasts": _broadcasts(mission, packer),
        "signals": _signals(mission, packer) if mission.signals else None,
        "covered": _covered(mission, track_step, packer),
        "shownUntil": {
            "latency": shown_until(latencies(mission)),
            "interval": shown_until(intervals(mission)),
        },
        "thinned": _thinned(mission, track_step, kept),
    }


def survey_data(setup: Setup) -> dict[str, Any]:
    """Return what all maps of a page show: the survey (m), the latitude and longitude (deg) of its
    x = y = 0, None where it is nowhere, the current (m/s) with the heading it flows to (deg), and
    where there is any land and water where nobody goes: polygons, each its outer ring and those of
    holes in it (m); and lines of equal depth of the bottom, if that is known: depth (m) and lines.
    """
    water = setup.scenario.environment
    closed = (("land", setup.land), ("keepOut", setup.keep_out))
    return {
        "outline": [list(corner) for corner in setup.area.outline],
        "origin": setup.origin_deg,
        "current": {"speed": water.current_m_per_s, "direction": water.current_direction_deg},
        **{name: what.outlines for name, what in closed if what is not None},
        **({"contours": _contours(setup)} if setup.bottom.is_known else {}),
    }


def _contours(setup: Setup) -> list[dict[str, Any]]:
    return [
        {"depth": depth, "lines": [line.round(1).tolist() for line in lines]}
        for depth, lines in setup.contours
    ]


def _step(count: int, most: int) -> int:
    return max(1, -(-count // most))


def _auv(mission: Recording, service: "Service", step: int, packer: Packer) -> dict[str, Any]:
    number, own = service.auv, mission.own
    x, y = (mission.truth[name][number][::step] for name in ("x_m", "y_m"))
    columns = {
        "x": packer.add(x, quantum=CENTIMETRE),
        "y": packer.add(y, quantum=CENTIMETRE),
        "yaw": packer.add(mission.truth["yaw_rad"][number][::step], quantum=CENTIRADIAN),
        "envelope": packer.add(error_envelope(mission, number)[::step], quantum=CENTIMETRE),
        "error": packer.add(own["position_error_m"][number][::step], quantum=MILLIMETRE),
    }
    columns |= _spread(mission, number, step, packer)
    for name, truth in (("x", x), ("y", y)):  # as errors: small numbers, and jumps are told apart
        estimate, imu = (own[f"{kind}_{name}_m"][number][::step] for kind in ("estimate", "imu"))
        columns[f"off_{name}"] = packer.add(estimate - truth, quantum=CENTIMETRE)
        columns[f"drift_{name}"] = packer.add(imu - truth, quantum=CENTIMETRE)
    return {
        "name": f"AUV{number}",
        "gaps": [[gap.start, gap.end] for gap in service.gaps],
        "plan": _plan(mission, number, packer),
        **columns,
    }


def _spread(mission: Recording, number: int, step: int, packer: Packer) -> dict[str, Any]:
    """Pack how sure an AUV is of its position: two sds and their correlation, for its ellipse."""
    xx, yy, xy = mission.covariance(number)[::step].T
    x, y = np.sqrt(xx), np.sqrt(yy)
    sure = x * y == 0.0
    return {
        "sd_x": packer.add(x, quantum=MILLIMETRE),
        "sd_y": packer.add(y, quantum=MILLIMETRE),
        "together": packer.add(np.where(sure, 0.0, xy / np.where(sure, 1.0, x * y)), quantum=0.01),
    }


def _plan(mission: Recording, number: int, packer: Packer) -> dict[str, Any] | None:
    """Return the planned path, None for an AUV that holds or repeats a track."""
    setup = mission.setup
    if (plan := setup.plans_that_ship[number]) is None:
        return None
    path = plan.path
    most = max(MOST_PLAN_POINTS // mission.auvs, 2)
    points = int(np.clip(path.length / setup.area.across * 200, 2, most))
    places = path.sample(np.linspace(0.0, path.length, points))
    return {
        "x": packer.add(places[:, 0], quantum=CENTIMETRE),
        "y": packer.add(places[:, 1], quantum=CENTIMETRE),
    }


def _covered(mission: Recording, step: int, packer: Packer) -> dict[str, Any] | None:
    """Pack the share (%) of the survey that is covered at each instant of the tracks."""
    if mission.swept is None:
        return None
    share = 100.0 * mission.swept[::step] / mission.setup.area.square_m
    return {"share": packer.add(share, quantum=CENTIMETRE)}


def _asv(mission: Recording, number: int, step: int, packer: Packer) -> dict[str, Any]:
    row = mission.auvs + number
    return {
        "name": f"ASV{number}",
        "failures": [
            [failure.at_s, failure.until_s]
            for failure in mission.scenario.asvs.failures
            if failure.asv == number
        ],
        "x": packer.add(mission.truth["x_m"][row][::step], quantum=CENTIMETRE),
        "y": packer.add(mission.truth["y_m"][row][::step], quantum=CENTIMETRE),
        **seen_data(mission.setup, number, partial(packer.add, quantum=CENTIMETRE)),
    }


def seen_data(setup: Setup, asv: int, packed: Callable[[Floats], Any]) -> dict[str, Any]:
    """Return the corners (m) of what is within the HF and MF range of an ASV that keeps station,
    less what land hides from there, north and east each `packed`; nothing where there is none.
    """
    if setup.land is None or not setup.kept_stations_m:
        return {}
    place, found = setup.kept_stations_m[asv], {}
    for band, reach in (("hf", setup.horizontal_reach_m), ("mf", setup.horizontal_mf_reach_m)):
        found[band] = [packed(axis) for axis in setup.land.seen(place, reach).T]
    return {"seen": found}


def _kept_pings(mission: Recording) -> NDArray[np.bool_]:
    """Return which pings are played: those of every k-th round where there are too many."""
    in_range = int(mission.pings["in_range_of"].sum())
    step = max(_step(len(mission.fate), MOST_PINGS), _step(in_range, MOST_RECEPTIONS))
    kept: NDArray[np.bool_] = mission.pings["round"] % step == 0
    return kept


def _pings(mission: Recording, kept: NDArray[np.bool_], packer: Packer) -> dict[str, Any]:
    """Pack the pings that are kept; with passive ranging a row for each AUV, with its ASV."""
    pings = mission.pings
    return {
        "id": packer.add(pings["ping"][kept]),
        "auv": packer.add(pings["auv"][kept]),
        "at": packer.add(pings["sent_at_s"][kept], quantum=TENTH_OF_MS),
        "x": packer.add(pings["x_m"][kept], quantum=CENTIMETRE),
        "y": packer.add(pings["y_m"][kept], quantum=CENTIMETRE),
        "fate": packer.add(mission.fate[kept]),
        **({"asv": packer.add(pings["asv"][kept])} if mission.scenario.protocol.asvs_ping else {}),
        **(_calls(pings, kept, packer) if _has_calls(mission) else {}),
    }


def _has_calls(mission: Recording) -> bool:
    return mission.scenario.protocol.calls and "call" in mission.pings  # older folders lack them


def _calls(pings: dict[str, NDArray[Any]], kept: NDArray[np.bool_], packer: Packer) -> Any:
    """Pack when and by which ASV each turn to ping was called, and whether its AUV answered."""
    return {
        "called": packer.add(pings["called_at_s"][kept], quantum=TENTH_OF_MS),
        "caller": packer.add(pings["called_by"][kept]),
        "answered": packer.add((pings["call"][kept] == "heard").astype(np.int64)),
    }


def _receptions(mission: Recording, kept: NDArray[np.bool_], packer: Packer) -> dict[str, Any]:
    """Pack the receptions in range of pings that are kept; `ping` counts the kept ones."""
    receptions = mission.receptions
    shown = kept[receptions["ping"]] & ~np.isin(receptions["outcome"], UNREACHED)
    shown &= np.isfinite(receptions["arrived_at_s"])  # nothing arrives of pings not sent (twtt)
    number = np.cumsum(kept) - 1
    return {
        "ping": packer.add(number[receptions["ping"][shown]]),
        "asv": packer.add(receptions["asv"][shown]),
        "at": packer.add(receptions["arrived_at_s"][shown], quantum=TENTH_OF_MS),
        "outcome": packer.add(_numbers(receptions["outcome"][shown], OUTCOMES)),
    }


def _numbers(outcomes: NDArray[Any], names: Sequence[str]) -> NDArray[np.int64]:
    """Return outcomes as their numbers among names."""
    if not names:  # of what nobody sent there are none
        return np.zeros(0, dtype=np.int64)
    return np.select([outcomes == name for name in names], range(len(names)))


def _fixes(mission: Recording, packer: Packer) -> dict[str, Any]:
    fixes = mission.fixes
    lengths = ("x_m", "y_m", "sd_x_m", "sd_y_m", "correction_m")
    return {
        "ping": packer.add(fixes["ping"]),
        "auv": packer.add(fixes["auv"]),
        "by": packer.add(fixes["broadcast_by"]),
        "outcome": packer.add(_numbers(fixes["outcome"], FIX_OUTCOMES)),
        "pinged": packer.add(fixes["pinged_at_s"], quantum=TENTH_OF_MS),
        "broadcast": packer.add(fixes["broadcast_at_s"], quantum=TENTH_OF_MS),
        "delivered": packer.add(fixes["delivered_at_s"], quantum=TENTH_OF_MS),
        "latency": packer.add(fixes["latency_s"], quantum=TENTH_OF_MS),
        "cov": packer.add(fixes["cov_xy_m2"], quantum=1e-6),
        **{name[:-2]: packer.add(fixes[name], quantum=MILLIMETRE) for name in lengths},
    }


def _broadcasts(mission: Recording, packer: Packer) -> dict[str, Any]:
    broadcasts = mission.broadcasts
    return {
        "asv": packer.add(broadcasts["asv"]),
        "at": packer.add(broadcasts["sent_at_s"], quantum=TENTH_OF_MS),
        "airtime": packer.add(broadcasts["airtime_s"], quantum=TENTH_OF_MS),
        "fixes": packer.add(broadcasts["fixes"]),
    }


def _signals(mission: Recording, packer: Packer) -> dict[str, Any]:
    """Pack which vehicle had what of which other, and what became of that, as it arrived; of too
    many each k-th that was sent.
    """
    signals = mission.signals
    kinds = sorted(set(signals["kind"]))
    _, sent = np.unique(signals["sent_at_s"], return_inverse=True)
    kept = sent % _step(len(sent), MOST_RECEPTIONS) == 0
    order = np.flatnonzero(kept)[np.argsort(signals["arrived_at_s"][kept], kind="stable")]
    return {
        "kinds": kinds,
        "kind": packer.add(_numbers(signals["kind"][order], kinds)),
        "from": packer.add(signals["sender"][order]),
        "to": packer.add(signals["listener"][order]),
        "sent": packer.add(signals["sent_at_s"][order], quantum=TENTH_OF_MS),
        "at": packer.add(signals["arrived_at_s"][order], quantum=TENTH_OF_MS),
        "outcome": packer.add(_numbers(signals["outcome"][order], OUTCOMES)),
    }


def _thinned(mission: Recording, step: int, kept: NDArray[np.bool_]) -> list[str]:
    """Return in sentences what a long mission's page leaves out; the tables hold it all."""
    sentences = []
    if step > 1:
        rate = mission.scenario.record.tracks_hz / step
        sentences.append(f"Tracks are shown at {rate:.3g} Hz, one of {step} rows of the table.")
    if not kept.all():
        sentences.append(
            f"Of {len(kept)} pings {int(kept.sum())} are played, all those of some rounds; "
            "sums and shares count all of them."
        )
    return sentences
