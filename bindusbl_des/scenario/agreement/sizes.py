"""How large a mission may be."""

from collections.abc import Iterator

from ..scenario_keys import ScenarioKeys
from .problem import Problem

# A mission larger than this would exhaust the memory of any workstation.
LARGEST_SAMPLES = 5e8


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield rates at which more samples would be kept than memory holds, or none."""
    begin = scenario.record.metrics_from_s
    if begin >= scenario.duration_s - 1 / scenario.record.metrics_hz and begin > 0:
        yield Problem(
            "record.metrics_from_s",
            f"nothing is left to judge of {scenario.duration_s:g} s from {begin:g} s on; begin "
            "earlier",
            ("duration_s",),
        )
    vehicles = scenario.auvs.count + scenario.asvs.count
    for name, rate in (
        ("record.metrics_hz", scenario.record.metrics_hz),
        ("record.tracks_hz", scenario.record.tracks_hz),
        ("navigation.imu_rate_hz", scenario.navigation.imu_rate_hz),
    ):
        samples = scenario.duration_s * rate * vehicles
        if samples > LARGEST_SAMPLES:
            yield Problem(
                name,
                f"{samples:.2g} samples ({scenario.duration_s:g} s x {rate:g} Hz x {vehicles} "
                f"vehicles) exceed {LARGEST_SAMPLES:.0e}; lower rate, duration or fleet",
                ("duration_s", "auvs.count", "asvs.count"),
            )
