"""Draw the house, `python docs/figures/house.py`: each room a box, on a row above all that it
imports from.

An arrow is an import; those that follow from others are left out (transitive reduction).
"""

import ast
from pathlib import Path

import networkx as nx

HERE = Path(__file__).parent
LIBRARY = HERE.parents[1] / "bindusbl_des"

FACES, MANY, MISSION, DATA = "#fdf3e1", "#eee8f7", "#dff0ee", "#e8edf2"
LINE, EDGE, WORD, SMALL = "#9aa7b3", "#5d6b78", "#1d2730", "#46535f"
WIDTH, BOX, TALL, PITCH, TOP = 1000, 176, 44, 74, 10
BEND = PITCH - TALL  # an arrow goes to its column between two rows

# The middle of each room's box, what it does in a few words, and its colour.
ROOMS = {
    "commands": (500, "the command line", FACES),
    "workbench": (790, "a page to draw and plan on", FACES),
    "planning": (500, "how many, where, how sure", MANY),
    "advice": (500, "what would help", MANY),
    "campaigns": (500, "many missions, statistics", MANY),
    "benchmark": (797, "tasks that methods enter", MANY),
    "recorded": (300, "recorded missions", MANY),
    "figures": (300, "matplotlib", FACES),
    "report": (510, "one HTML page", FACES),
    "explain": (310, "why a fix was late", FACES),
    "gym": (500, "missions to learn from", FACES),
    "verification": (700, "may signals overlap", MISSION),
    "live": (890, "telegrams against the clock", FACES),
    "export": (110, "MCAP, CSV, GeoJSON, KML", FACES),
    "setup": (500, "facts of a scenario", MISSION),
    "models": (900, "parts that ship", MISSION),
    "mission": (710, "world, simulation, metrics", MISSION),
    "results": (605, "tables, folder", DATA),
    "preflight": (350, "what is known beforehand", DATA),
    "protocol": (500, "slots, schedules, both bands", MISSION),
    "acoustics": (250, "channels, loss, travel time", MISSION),
    "usbl": (500, "array, instrument, fusion", MISSION),
    "navigation": (750, "dead reckoning, navigators", MISSION),
    "scenario": (500, "keys, parts, files", DATA),
    "vehicles": (610, "motion, hulls, guidance", MISSION),
    "presets": (110, "figures of data sheets", DATA),
    "sea": (300, "sound speed, absorption", MISSION),
    "records": (490, "events and their columns", DATA),
    "charts": (680, "files of places on Earth", MISSION),
    "support": (450, "clocks, streams, files", DATA),
    "geometry": (880, "formations, coverage, paths", MISSION),
}


def room_of(parts: tuple[str, ...]) -> str:
    """Return the room of a module: of `core` and `apps` a folder; charts and presets are rooms of
    `models`, all else there is one.
    """
    group, room = (*parts, "")[:2]
    inner = group in ("core", "apps") or (group == "models" and room in ROOMS)
    return room if inner else group


def imports() -> nx.DiGraph:
    """Return which room imports from which, without what follows from other imports."""
    found = nx.DiGraph()
    for path in LIBRARY.rglob("*.py"):
        here = path.relative_to(LIBRARY).with_suffix("").parts
        room = room_of(here)
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.level and room in ROOMS:
                above = here[: len(here) - node.level]
                module = (*above, *(node.module or "").split(".")) if node.module else above
                others = {room_of((*module, name.name)) for name in node.names}
                found.add_edges_from((room, other) for other in others & ROOMS.keys() - {room})
    return nx.transitive_reduction(found)


def rows(graph: nx.DiGraph) -> dict[str, int]:
    """Return the row of each room, 0 at the bottom: just above the highest that it imports from."""
    found: dict[str, int] = {}
    for room in reversed(list(nx.topological_sort(graph))):
        found[room] = max((found[other] + 1 for other in graph[room]), default=0)
    return found


def drawn(graph: nx.DiGraph) -> str:
    """Return the picture as SVG."""
    level = rows(graph)
    top = {room: TOP + PITCH * (max(level.values()) - row) for room, row in level.items()}
    height = max(top.values()) + TALL + TOP
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        'font-family="system-ui, sans-serif" role="img" aria-label="The rooms of bindusbl_des from '
        "the command line at the top to support at the bottom; arrows show which room imports "
        'from which">',
        '<defs><marker id="a" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        f'markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z" fill="{LINE}"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
    ]
    for room, other in sorted(graph.edges):
        x, y, x_end, y_end = ROOMS[room][0], top[room] + TALL, ROOMS[other][0], top[other] - 1
        middle, below = y + BEND // 2, y + BEND - 10
        lines.append(
            f'<path d="M{x} {y}C{x} {middle} {x_end} {middle} {x_end} {below}L{x_end} {y_end}" '
            f'fill="none" stroke="{LINE}" stroke-width="1.4" marker-end="url(#a)"/>'
        )
    for room, (x, words, colour) in ROOMS.items():
        y = top[room]
        lines.append(
            f'<rect x="{x - BOX // 2}" y="{y}" width="{BOX}" height="{TALL}" rx="7" '
            f'fill="{colour}" stroke="{EDGE}"/><text x="{x}" y="{y + 19}" text-anchor="middle" '
            f'font-size="14" font-weight="600" fill="{WORD}">{room}</text><text x="{x}" '
            f'y="{y + 36}" text-anchor="middle" font-size="11" fill="{SMALL}">{words}</text>'
        )
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    (HERE / "house.svg").write_text(drawn(imports()), encoding="utf-8")
