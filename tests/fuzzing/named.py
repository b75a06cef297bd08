"""Files that scenarios name, one of every kind, damaged; and what reads them."""

import io
import itertools
import json
import re
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from .files import CELLS, RUN, SCENARIO, Lines
from .texts import bytes_mutated, encoded, lines_mutated
from .trees import as_yaml, mutated

# A field in Kiel fjord: longitude and latitude of its corners
RING = [[10.18, 54.33], [10.1805, 54.33], [10.1805, 54.3303], [10.18, 54.3303], [10.18, 54.33]]
POLYGON = {"type": "Polygon", "coordinates": [RING]}
PLACES = " ".join(f"{lon},{lat},0" for lon, lat in RING)
KML = f"""<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><name>Area</name><Polygon>
<outerBoundaryIs><LinearRing><coordinates>{PLACES}</coordinates></LinearRing></outerBoundaryIs>
</Polygon></Placemark></Document></kml>
"""
GPX = """<?xml version="1.0"?>
<gpx version="1.1" creator="test" xmlns="http://www.topografix.com/GPX/1/1">
<trk><name>AUV0</name><trkseg>
<trkpt lat="54.33" lon="10.18"><ele>-10</ele><time>2026-11-22T14:00:00Z</time></trkpt>
<trkpt lat="54.3301" lon="10.18"><ele>-12.5</ele><time>2026-11-22T14:01:00Z</time></trkpt>
</trkseg></trk></gpx>
"""
CAST = "depth_m,temperature_c,salinity_psu\n0.5,22,33.0\n5,21.5,33.2\n12,14.0,34.6\n30,9,35\n"
CURVE = "range_m,delivery_ratio\n12,0.95\n24,0.7\n46,0.885\n99,0.99\n"
AIRTIMES = "payload_bytes,airtime_s,processing_delay_mean_s\n" + "".join(
    f"{size},{0.2 + 0.01 * size:.2f},0.05\n" for size in range(1, 65)
)
TIME_S = {place: (place[0] ** 2 + (place[2] - place[1]) ** 2) ** 0.5 / 1500 for place in
          itertools.product((1, 50, 300), (1, 5), (1, 20))}  # fmt: skip
RAYS = "range_m,source_depth_m,receiver_depth_m,travel_time_s,loss_db\n" + "".join(
    f"{away},{source},{receiver},{time:.6f},40\n" for (away, source, receiver), time in
    TIME_S.items()
)  # fmt: skip

CSV_CELL, XML_VALUE = re.compile(r"[^,\n]+"), re.compile(r'(?<=")[^"<>]+(?=")|(?<=>)[^<>\n]+(?=<)')

# When the first point of GPX is, in Unix time
NOON_S = 1_795_356_000

ON_EARTH = {"environment": {"origin": {"lat_deg": 54.33, "lon_deg": 10.18}}}


def hf(**channel: Any) -> dict[str, Any]:
    return {"acoustics": {"hf": {"channel": channel}}}


def tracked(name: str, begins_s: float = 0.0) -> dict[str, Any]:
    route = {"kind": "track", "files": [name], "time_offset_s": begins_s}
    return {**ON_EARTH, "auvs": {"count": 1, "route": route}}


def mcap() -> bytes:
    """Return a recording of one position a minute."""
    from mcap.writer import Writer

    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    schema = writer.register_schema("foxglove.LocationFix", "jsonschema", b"{}")
    channel = writer.register_channel("/auv", "json", schema)
    for number in range(3):
        time = {"sec": 60 * number, "nsec": 0}
        at = {"timestamp": time, "latitude": 54.33 + 1e-4 * number, "longitude": 10.18}
        now = 60_000_000_000 * number
        writer.add_message(channel, now, json.dumps({**at, "altitude": -10}).encode(), now)
    writer.finish()
    return file.getvalue()


# The name of a file, what it holds, and what a scenario says that names it
SORTS: tuple[tuple[str, Any, Callable[[str], dict[str, Any]]], ...] = (
    ("area.geojson", POLYGON, lambda it: {"survey": {"area": it}}),
    ("area.kml", KML, lambda it: {"survey": {"area": it}}),
    ("cast.csv", CAST, lambda it: {"environment": {"ctd": it}}),
    ("curve.csv", CURVE, lambda it: hf(model="curve", file=it)),
    ("airtimes.csv", AIRTIMES, lambda it: {"acoustics": {"mf": {"airtimes": it}}}),
    ("rays.csv", RAYS, lambda it: hf(model="table", rays=it)),
    ("track.gpx", GPX, lambda it: tracked(it, NOON_S)),
    ("track.mcap", mcap, tracked),
)  # fmt: skip


def named(seed: int, draw: Random) -> Lines:
    """Write a damaged file here and a scenario that names it; return what reads both."""
    name, content, says = SORTS[seed % len(SORTS)]
    Path(name).write_bytes(_damaged(content, draw))
    scenario = {"name": "n", "duration_s": 2.0, "record": {"detail": "summary"}, **says(name)}
    Path(SCENARIO).write_text(as_yaml(scenario), encoding="utf-8")
    dry = ["sweep", SCENARIO, "--dry-run"]
    lines = (["validate", SCENARIO], ["timing", SCENARIO], ["coverage", SCENARIO], dry, RUN, RUN)
    return [draw.choice(lines)]


def _damaged(content: Any, draw: Random) -> bytes:
    """Return what a file holds, with something wrong in it most times."""
    raw: bytes
    if callable(content):
        raw = content()
    elif isinstance(content, str):
        raw = encoded(_text(content, draw), draw)
    else:
        data = json.loads(json.dumps(content))
        for _ in range(draw.choice((0, 1, 1, 3))):
            data = mutated(data, draw)
        raw = encoded(json.dumps(data), draw)
    return bytes_mutated(raw, draw) if draw.random() < 0.25 else raw


def _text(text: str, draw: Random) -> str:
    """Return a text with cells or lines of it changed; those of XML stand between its marks."""
    how = draw.random()
    if how < 0.2:
        return text
    if how < 0.4:
        return lines_mutated(text, draw)
    cell = XML_VALUE if text.startswith("<") else CSV_CELL
    for _ in range(draw.choice((1, 1, 2, 5))):
        place = draw.choice(list(cell.finditer(text)))
        text = f"{text[: place.start()]}{draw.choice(CELLS)}{text[place.end() :]}"
    return text
