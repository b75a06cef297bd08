"""Plans of QGroundControl (`.plan`): the path of a vehicle's mission, and the areas it surveys.

Source: QGroundControl developer guide, "Plan File Format": JSON of fileType "Plan", whose mission
has items, each a MAVLink command with seven parameters, or several of them made of an area.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ...support.files import read_json
from ...support.wording import described, shortened
from .shapes import BadChart, Degrees, Shape, checked, position

# Commands (MAV_CMD) that lead to a place: way points, loitering there, and points of a spline.
TO_A_PLACE = frozenset({16, 17, 18, 19, 82})

ORDER = "latitude, longitude"
AREA, TRANSECTS = "polygon", "TransectStyleComplexItem"


def read_vehicle_plan(path: str | Path) -> list[Shape]:
    """Return the path of a plan's mission as a line, and the areas of its surveys as polygons.

    Raises:
        BadChart: naming file, item and remedy.
    """
    try:
        plan = read_json(Path(path))
    except OSError as error:
        raise BadChart(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise BadChart(f"{path}: is no plan of QGroundControl: {error}") from None
    if not isinstance(plan, dict) or plan.get("fileType") != "Plan":
        raise BadChart(
            f'{path}: is no plan of QGroundControl: it needs "fileType": "Plan"; save it there anew'
        )
    mission = plan.get("mission")
    items = mission.get("items") if isinstance(mission, dict) else None
    if not isinstance(items, list):
        raise BadChart(f"{path}: its mission needs a list of items; got {described(items)}")
    way, shapes = list[Degrees](), list[Shape]()
    for number, item in enumerate(items):
        where = f"{path}: item {number}"
        way += _places(item, where)
        if isinstance(item, Mapping) and item.get("complexItemType") == "survey":
            corners = _listed(item.get(AREA), where)
            if len(corners) > 2:
                shapes.append(checked(Shape(AREA, where, tuple(corners), name=f"survey {number}")))
    if len(way) > 1:
        shapes.append(checked(Shape("line", str(path), tuple(way), name=Path(path).stem)))
    return shapes


def _places(item: Any, where: str) -> Iterator[Degrees]:
    """Yield the positions of an item: the target of its command, or the transects of a survey."""
    if not isinstance(item, Mapping):
        raise BadChart(f"{where}: is no item of a mission ({described(item)})")
    transects = item.get(TRANSECTS)
    if isinstance(transects, Mapping):
        inside = transects.get("Items")
        found = [place for one in inside or () for place in _places(one, where)]
        yield from found or _listed(transects.get("VisualTransectPoints"), where)
    elif item.get("command") in TO_A_PLACE:
        params = item.get("params")
        if not isinstance(params, list) or len(params) < 7:
            raise BadChart(f"{where}: needs seven params; got {shortened(repr(params))}")
        yield _place(params[4:6], where)


def _listed(places: Any, where: str) -> list[Degrees]:
    return [_place(place, where) for place in places or ()] if isinstance(places, list) else []


def _place(given: Any, where: str) -> Degrees:
    numbers = isinstance(given, list) and len(given) >= 2
    if not numbers or not all(type(number) in (int, float) for number in given[:2]):
        raise BadChart(f"{where}: needs numbers {ORDER}; got {shortened(repr(given))}")
    return position(float(given[0]), float(given[1]), where, ORDER)
