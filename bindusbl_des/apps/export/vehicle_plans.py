"""Plans of QGroundControl: what each vehicle of a survey's plan is to do, a file for each.

Source: QGroundControl developer guide, "Plan File Format"; commands, frames, types: MAVLink.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ...core.setup import Setup
from ...support.files import folder_draft
from .chart_files import earthly, planned_lanes

# MAV_CMD: a way point, to stay without an end, a speed; MAV_FRAME: above home, none
WAYPOINT, STAY, SPEED = 16, 17, 178
ABOVE_HOME, NO_PLACE = 3, 2
# MAV_AUTOPILOT_ARDUPILOTMEGA (ArduSub, ArduRover); MAV_TYPE of an underwater vehicle and of a boat
ARDUPILOT, SUBMARINE, BOAT = 3, 12, 11
ENDING = ".plan"


def write_vehicle_plans(setup: Setup, folder: Path, *, force: bool = False) -> dict[str, int]:
    """Write a folder with a plan for each AUV, along its lanes, and for each vessel that keeps
    station, at its place; return how many way points each has.

    Depths are altitudes below home, which is at the surface.

    Raises:
        ValueError: when the scenario is nowhere on Earth.
        FileExistsError: when the folder exists and must not be replaced.
        OSError: when it cannot be written.
    """
    plans = dict(_plans(setup))
    with folder_draft(folder, objection_to_plans, force=force) as draft:
        for name, plan in plans.items():
            (draft / f"{name}{ENDING}").write_text(f"{json.dumps(plan, indent=4)}\n")
    return {name: len(plan["mission"]["items"]) for name, plan in plans.items()}


def objection_to_plans(folder: Path) -> str | None:
    """Return why force must not replace a folder; None for one of plans alone, or nothing."""
    files = list(folder.iterdir()) if folder.is_dir() else [folder]
    foreign = sorted(path.name for path in files if path.suffix != ENDING or not path.is_file())
    return f"holds {foreign[0]}, which no export wrote, so it is not replaced" if foreign else None


def _plans(setup: Setup) -> Iterator[tuple[str, dict[str, Any]]]:
    on_earth = earthly(setup)
    surface_m = setup.scenario.environment.surface_m
    for number, lane in planned_lanes(setup).items():
        auv, places = setup.auvs[number], lane.tolist()
        depths, speed = [setup.depth_at(auv, (x, y)) for x, y in places], auv.speed_m_per_s
        items = [_item(SPEED, [1, speed, -1, 0, 0, 0, 0])]
        items += [
            _at(WAYPOINT, *place, -depth)
            for place, depth in zip(on_earth(places), depths, strict=True)
        ]
        yield f"AUV{number}", _plan(items, SUBMARINE, speed, surface_m)
    for number, place in enumerate(on_earth(setup.kept_stations_m)):
        yield f"ASV{number}", _plan([_at(STAY, *place, 0.0)], BOAT, 1.0, surface_m)


def _at(command: int, lon: float, lat: float, altitude: float) -> dict[str, Any]:
    said = {"Altitude": altitude, "AltitudeMode": 1, "AMSLAltAboveTerrain": None}
    return {**_item(command, [0, 0, 0, None, lat, lon, altitude], ABOVE_HOME), **said}


def _item(command: int, params: Sequence[Any], frame: int = NO_PLACE) -> dict[str, Any]:
    said = {"type": "SimpleItem", "autoContinue": True}
    return {**said, "command": command, "frame": frame, "params": list(params)}


def _plan(
    items: list[dict[str, Any]], vehicle: int, speed: float, surface_m: float
) -> dict[str, Any]:
    for number, item in enumerate(items, 1):
        item["doJumpId"] = number
    lat, lon = next(item["params"][4:6] for item in items if item["frame"] == ABOVE_HOME)
    return {
        "fileType": "Plan",
        "groundStation": "QGroundControl",
        "version": 1,
        "mission": {
            "version": 2,
            "firmwareType": ARDUPILOT,
            "vehicleType": vehicle,
            "cruiseSpeed": speed,
            "hoverSpeed": speed,
            "globalPlanAltitudeMode": 1,
            "plannedHomePosition": [lat, lon, surface_m],
            "items": items,
        },
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "rallyPoints": {"points": [], "version": 2},
    }
