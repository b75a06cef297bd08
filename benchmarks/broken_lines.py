"""How sharp the everyday tests are: lines of the library are broken, and the tests asked whether.

python benchmarks/broken_lines.py               break 40 lines, drawn with seed 0
python benchmarks/broken_lines.py 80 --seed 1   other ones

Of equations, protocol, navigation, metrics and planner as many lines each are drawn, and in each
one operator, comparison or number is replaced by another.  The everyday tests of its room, the
golden tables and the missions' tests then run until one fails.  Some of what survives is the same
program (`<` for `<=` of a float, the thickness of a line): read the list.  All of it happens in a
copy, one after the other; put `nice` before it on a machine that has other work.
"""

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "bindusbl_des"

# What is broken, and by which tests beside the room's own it is noticed.
ROOMS = {
    "equations": ("acoustics", "geometry", "sea", "usbl", "vehicles"),
    "protocol": ("protocol",),
    "navigation": ("navigation",),
    "metrics": ("mission", "records"),
    "planner": ("planning",),
}
SHARED = ("tests/test_golden.py", "tests/mission")
LONGEST_S = 900.0  # of the tests beside one broken line; a loop without end counts as noticed

SWAPS = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "/", ast.Mod: "+",
    ast.Pow: "*", ast.Lt: ">=", ast.LtE: "<", ast.Gt: "<=", ast.GtE: ">", ast.Eq: "!=",
    ast.NotEq: "==", ast.Is: "is not", ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in",
    ast.And: "or", ast.Or: "and",
}  # fmt: skip
OPERATOR = re.compile(r"\*\*|//|[<>=!]=|[-+*/%<>]|\b(?:is not|not in|is|in|and|or)\b")
SKIPPED = ("annotation", "returns", "decorator_list")  # these compute nothing


class Break(NamedTuple):
    """A place in a file (bytes from `begin` to `end`), what stands there, and what shall."""

    file: Path
    line: int
    begin: int
    end: int
    new: str

    def __str__(self) -> str:
        text = (ROOT / self.file).read_bytes()
        line = text.splitlines()[self.line - 1].decode().strip()
        old = text[self.begin : self.end].decode()
        return f"{self.file}:{self.line}: {old} -> {self.new}   {line}"


def breaks(file: Path) -> list[Break]:
    """Return all that may be broken in a file, named from the root of the repository."""
    text = (ROOT / file).read_bytes()
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def at(line: int, column: int) -> int:
        return starts[line - 1] + column

    def between(left: ast.expr, right: ast.expr, kind: ast.AST) -> Iterator[Break]:
        begin = at(left.end_lineno or 0, left.end_col_offset or 0)
        found = OPERATOR.search(text[begin : at(right.lineno, right.col_offset)].decode())
        if found and type(kind) in SWAPS:
            line = left.end_lineno or 0
            new = SWAPS[type(kind)]
            yield Break(file, line, begin + found.start(), begin + found.end(), new)

    def within(node: ast.AST) -> Iterator[Break]:
        if isinstance(node, ast.JoinedStr):
            return
        if isinstance(node, ast.BinOp):
            yield from between(node.left, node.right, node.op)
        elif isinstance(node, ast.BoolOp):
            yield from between(node.values[0], node.values[1], node.op)
        elif isinstance(node, ast.Compare):
            yield from between(node.left, node.comparators[0], node.ops[0])
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            new = node.value + 1 if isinstance(node.value, int) else 1.125 * node.value or 0.125
            begin, end = at(node.lineno, node.col_offset), at(node.lineno, node.end_col_offset or 0)
            yield Break(file, node.lineno, begin, end, repr(new))
        for name, part in ast.iter_fields(node):
            for inner in part if isinstance(part, list) else [part]:
                if isinstance(inner, ast.AST) and name not in SKIPPED:
                    yield from within(inner)

    return list(within(ast.parse(text)))


def drawn(count: int, seed: int) -> list[Break]:
    """Return so many places, rooms in turn; every line that can be broken is as likely."""
    draw = random.Random(seed)
    places = []
    for folders in ROOMS.values():
        files = [it for name in folders for it in sorted((ROOT / PACKAGE / name).rglob("*.py"))]
        lines: dict[tuple[Path, int], list[Break]] = {}
        for it in (it for file in files for it in breaks(file.relative_to(ROOT))):
            lines.setdefault((it.file, it.line), []).append(it)
        chosen = draw.sample(sorted(lines), min(len(lines), count))
        places.append([draw.choice(lines[it]) for it in chosen])
    return list(islice((room[k] for k in range(count) for room in places if k < len(room)), count))


def noticed(copy: Path, place: Break) -> str:
    """Return which test fails in a copy of the repository with a place broken, or ""."""
    path = copy / place.file
    text = path.read_bytes()
    path.write_bytes(text[: place.begin] + place.new.encode() + text[place.end :])
    tests = [str(place.file), f"tests/{place.file.parts[1]}", *SHARED]
    tests = list(dict.fromkeys(it for it in tests if (copy / it).exists()))
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(
            command, cwd=copy, capture_output=True, text=True, timeout=LONGEST_S, check=False,
            env={**os.environ, "PYTHONPATH": str(copy)},
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return f"no end after {LONGEST_S:g} s"
    finally:
        path.write_bytes(text)
    if done.returncode == 0:
        return ""
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    return found[1] if found else "it does not even start"


def main() -> None:
    """Break lines as the command line says, and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    caught = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".git", ".venv", "demo-results"))
        places = drawn(given.count, given.seed)
        if by := noticed(copy, places[0]._replace(end=places[0].begin, new="")):
            sys.exit(f"the tests fail with nothing broken: {by}")
        for place in places:
            by = noticed(copy, place)
            caught += bool(by)
            print(f"{'caught' if by else 'SURVIVED'}: {place}   {by}", flush=True)
    print(f"{caught} of {len(places)} broken lines are caught")


if __name__ == "__main__":
    main()
