"""What could be changed about a plan: one file of proposals, which simulation then judges."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

from ...core.geometry.formation import ring_radius
from ...core.results.effects import FILTER, GAIN
from ...core.scenario import families
from ...core.scenario.files.overrides import put
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.wording import counted, plain
from ..preflight.fix_chance import HALF, delivery
from .stations import Ways

if TYPE_CHECKING:
    from ...core.results.result import Result

GAINS = (0.5, 0.2, 0.35, 0.7, 0.1, 0.05)
# Where fixes raise the error, they are to be trusted less.
SMALL_GAINS = (0.05, 0.2, 0.1, 0.02, 0.35, 0.5)
FACTORS = (1.5, 1.25, 2.0)

STATIONS, COUNT, RANGES, PAIR = "formation", "number of ASVs", "ranges", "pair"
DELAY = "delay compensation"
# Kinds that set the same keys, or of which one leaves the other without effect.
EXCLUSIVE = ({STATIONS, COUNT}, {FILTER, GAIN}, {FILTER, DELAY})

Settings = Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Change:
    """A change of a scenario: its kind, in words, and the keys (dotted) that it sets."""

    kind: str
    words: str
    settings: Settings

    @property
    def lines(self) -> tuple[str, ...]:
        """What `--set` takes."""
        return tuple(f"{key}={plain(value)}" for key, value in self.settings.items())


def may_be_paired(one: Change, other: Change) -> bool:
    """Tell whether two changes make sense together."""
    return one.kind != other.kind and {one.kind, other.kind} not in EXCLUSIVE


def both(one: Change, other: Change) -> Change:
    """Return two changes as one; where ASVs lie, their formation decides."""
    if one.kind in (STATIONS, COUNT):
        one, other = other, one
    return Change(PAIR, f"{one.words}, and {other.words}", {**one.settings, **other.settings})


def changed(scenario: Scenario, settings: Settings) -> Scenario | None:
    """Return a scenario with other settings; None where its parts would contradict each other."""
    data = scenario.model_dump(mode="json")
    for key, value in settings.items():
        put(data, key, value)
    try:
        return Scenario.model_validate(data)
    except ValueError:  # as pydantic's errors are
        return None


def proposals(result: "Result") -> tuple[list[Change], list[str]]:
    """Return what to try, most promising first and kinds mixed, and what there is no need to try.

    Proposals come from the scenario and from what its mission ran short of; whether they are any
    good only trials can tell.
    """
    scenario, auvs = result.scenario, result.arrow["auvs"].to_pylist()
    setup = result.setup
    needless: list[str] = []
    if not scenario.asvs.count:  # all else acts on rounds, of which there is none
        needless.append("other rounds, ranges and filters (there is no ASV)")
        one = [*_another(scenario)]
        return [change for change in one if changed(scenario, change.settings)], needless
    kinds = [
        _filters(scenario),
        _delays(setup),
        _gains(setup, min(row["fix_benefit_m"] for row in auvs) < 0, needless),
        *_formations(setup, needless),
        _losses(setup),
        *_ranges(setup, auvs, needless),
        *_protocols(scenario, needless),
    ]
    mixed = [change for row in zip_longest(*kinds) for change in row if change is not None]
    return [change for change in mixed if changed(scenario, change.settings) is not None], needless


def _filters(scenario: Scenario) -> Iterator[Change]:
    now = scenario.navigation.filter
    if not scenario.navigation.weighs:
        yield Change(FILTER, f"filter kalman instead of {now}", {"navigation.filter": "kalman"})


def _delays(setup: Setup) -> Iterator[Change]:
    navigation = setup.scenario.navigation
    if setup.navigator.has_gain and navigation.fixed_gain.delay_compensation == "none":
        yield Change(
            DELAY,
            "compare fixes with the estimate at their ping (delay compensation)",
            {"navigation.filter.delay_compensation": "shift"},
        )


def _gains(setup: Setup, harmful: bool, needless: list[str]) -> Iterator[Change]:
    now = setup.scenario.navigation.fixed_gain.gain
    if not setup.navigator.has_gain:
        needless.append("another gain or delay compensation (the filter has none)")
        return
    for gain in SMALL_GAINS if harmful else GAINS:
        if abs(gain - now) > 0.1 * now:
            words = f"a gain of {gain:g} instead of {now:g}"
            yield Change(GAIN, words, {"navigation.filter.gain": gain})


def _protocols(scenario: Scenario, needless: list[str]) -> list[Iterator[Change]]:
    if scenario.protocol.asvs_ping:
        needless.append("another schedule, downlink or broadcaster (AUVs fix themselves)")
        return []
    return [
        _others(scenario, "downlink", _downlinks(scenario)),
        _schedules(scenario, needless),
        _broadcasters(scenario, needless),
    ]


def _downlinks(scenario: Scenario) -> tuple[str, ...]:
    """Return the downlinks that differ: with random access all with broadcasts mean the same.

    Answers without airtime are not advised: no modem can give them.
    """
    instant = not scenario.protocol.answer.takes_airtime
    names = [
        name
        for name in families.advised(families.DOWNLINK)
        if not (families.DOWNLINK.traits[name].replies and instant)
    ]
    if not scenario.protocol.random_access:
        return tuple(names)
    broadcast = [
        name
        for name in names
        if not families.DOWNLINK.traits[name].replies and families.DOWNLINK.traits[name].waits
    ]
    answered = [name for name in names if families.DOWNLINK.traits[name].replies]
    return tuple(broadcast if scenario.protocol.replies else answered)


def _schedules(scenario: Scenario, needless: list[str]) -> Iterator[Change]:
    if scenario.auvs.count == 1:
        needless.append("another schedule (there is one AUV)")
        return
    yield from _others(scenario, "schedule", families.advised(families.SCHEDULE))


def _broadcasters(scenario: Scenario, needless: list[str]) -> Iterator[Change]:
    if scenario.asvs.count == 1 or scenario.protocol.replies:
        needless.append("another broadcaster (no frame has a choice of ASVs)")
        return
    yield from _others(scenario, "broadcaster", families.advised(families.BROADCASTER))


def _others(scenario: Scenario, key: str, names: tuple[str, ...]) -> Iterator[Change]:
    """Yield the other values of a key of the protocol."""
    now = getattr(scenario.protocol, key)
    for name in names:
        if name != now:
            yield Change(key, f"{key} {name} instead of {now}", {f"protocol.{key}": name})


def _ranges(
    setup: Setup, auvs: list[dict[str, Any]], needless: list[str]
) -> list[Iterator[Change]]:
    scenario = setup.scenario
    hf, mf = scenario.acoustics.hf.range_m, scenario.acoustics.mf.range_m
    heard = all(row["hf_coverage"] in (None, 1.0) for row in auvs)
    reached = all(row["fixes_out_of_range"] == 0 for row in auvs)
    found = []
    if heard and scenario.asvs.count == 1:
        needless.append("a longer HF range (every ping was within it)")
    elif scenario.protocol.asvs_ping:
        return [_longer(setup, hf=hf)]
    else:
        found += [_longer(setup, hf=hf), _longer(setup, hf=hf, mf=mf)]
    if scenario.protocol.asvs_ping:
        return []
    if reached:
        needless.append("a longer MF range alone (no fix was broadcast beyond it)")
    else:
        found.append(_longer(setup, mf=mf))
    return found if reached else found[::-1]  # who hears more must tell more


def _losses(setup: Setup) -> Iterator[Change]:
    """Yield a loss law that is made for the HF range, where most pings over that are lost."""
    hf, law = setup.scenario.acoustics.hf, setup.scenario.acoustics.loss.law
    found = delivery(setup, "hf")
    if hf.traits.ends_at_range and law != "scaled" and found is not None and found[1] < HALF:
        words = f"pings that carry over {hf.range_m:g} m (loss law scaled instead of {law})"
        yield Change("loss law", words, {"acoustics.loss.law": "scaled"})


def _longer(setup: Setup, **now: float) -> Iterator[Change]:
    """Yield longer ranges (m) of the bands named; the ASVs stay where they are."""
    for factor in FACTORS:
        ranges = {band: float(f"{factor * length:.3g}") for band, length in now.items()}
        words = " and ".join(
            f"{band.upper()} range {ranges[band]:g} m instead of {now[band]:g} m" for band in now
        )
        settings = {f"acoustics.{band}.range_m": length for band, length in ranges.items()}
        kept = _kept(setup) if "hf" in now else {}
        yield Change(RANGES, words, {**settings, **kept})


def _kept(setup: Setup) -> dict[str, Any]:
    """Return what keeps a formation where it is, since by default it grows with the HF range."""
    scenario = setup.scenario
    asked = scenario.asvs.formation.moored
    if asked is None or asked.is_placed or asked.radius_m is not None or scenario.asvs.count == 1:
        return {}
    return _ring(scenario, ring_radius(setup.stations_m), asked.angle_deg)


def _ring(scenario: Scenario, radius: float, angle: float) -> dict[str, Any]:
    """Return the settings of a regular formation, laid over whatever the file asks for."""
    asked = scenario.asvs.formation.moored
    assert asked is not None  # user-defined placements are not moved
    settings: dict[str, Any] = {}
    for name in ("positions_m", "positions_deg"):
        if getattr(asked, name) is not None:
            settings[f"asvs.formation.{name}"] = None
    if asked.clearance_m:
        settings["asvs.formation.clearance_m"] = 0
    settings["asvs.formation.radius_m"] = float(f"{radius:.6g}")
    if angle != asked.angle_deg:
        settings["asvs.formation.angle_deg"] = float(f"{angle:.6g}")
    return settings


def _formations(setup: Setup, needless: list[str]) -> list[Iterator[Change]]:
    scenario = setup.scenario
    asked = scenario.asvs.formation
    if asked.moves:
        needless.append("other places of ASVs (they move)")
        is_fixed = scenario.asvs.groups or getattr(asked, "start_m", ()) is not None
        return [] if is_fixed else [_another(scenario)]
    if asked.moored is None:
        needless.append("other places of ASVs (a placement of your own puts them there)")
        return []
    ways = Ways(scenario)
    if scenario.asvs.groups:
        needless.append("one more ASV (asvs.groups says which there are)")
        return [_moved(setup, ways)]
    if scenario.asvs.count == 1:
        needless.append("another radius or angle (a single ASV lies in the middle)")
        return [_more(setup, ways)]
    return [_moved(setup, ways), _more(setup, ways)]


def _another(scenario: Scenario) -> Iterator[Change]:
    """Yield the plan with one more ASV, where those go that move, or the first one."""
    count = scenario.asvs.count + 1
    words = f"{counted(count, 'ASV')} instead of {count - 1}"
    yield Change(COUNT, words, {"asvs.count": count})


def _moved(setup: Setup, ways: Ways) -> Iterator[Change]:
    """Yield formations of as many ASVs that serve the AUVs' ways best."""
    scenario = setup.scenario
    asked, count = scenario.asvs.formation.moored, scenario.asvs.count
    assert asked is not None
    if not asked.is_placed:
        radius, angle = ways.best(count, [ring_radius(setup.stations_m)])
        yield Change(
            STATIONS,
            f"the formation turned to {angle:g} deg",
            {"asvs.formation.angle_deg": angle},
        )
        radius, angle = ways.best(count, angles=[asked.angle_deg])
        yield Change(
            STATIONS, f"a formation radius of {radius:g} m", _ring(scenario, radius, angle)
        )
    radius, angle = ways.best(count)
    words = f"a formation radius of {radius:g} m at {angle:g} deg"
    yield Change(STATIONS, words, _ring(scenario, radius, angle))


def _more(setup: Setup, ways: Ways) -> Iterator[Change]:
    """Yield plans with one more ASV."""
    scenario = setup.scenario
    asked, count = scenario.asvs.formation.moored, scenario.asvs.count + 1
    assert asked is not None
    words = f"{count} ASVs instead of {count - 1}"
    if asked.is_placed:
        now = setup.stations_m
        x, y = ways.further(now)
        places = [*map(list, now), [x, y]]
        settings = {"asvs.count": count, "asvs.formation.positions_m": places}
        if asked.positions_deg is not None:
            settings["asvs.formation.positions_deg"] = None
        yield Change(COUNT, f"{words}, the new one at x {x:g} m, y {y:g} m", settings)
        return
    radius, angle = ways.best(count)
    ring = {"asvs.count": count, **_ring(scenario, radius, angle)}
    yield Change(COUNT, f"{words}, {radius:g} m out at {angle:g} deg", ring)
    yield Change(COUNT, f"{words}, the formation as it is", {"asvs.count": count})
