"""How sharp the everyday tests are: mutants of the library are drawn, and the tests kill them.

python benchmarks/mutations.py                 300 mutants, drawn with seed 0
python benchmarks/mutations.py 60 --seed 1     other ones
python benchmarks/mutations.py 60 --first 120  go on where a run has ended
python benchmarks/mutations.py 60 --rooms navigation metrics

Of equations, protocol, navigation, verification, the planner's selection and metrics as many lines
each are drawn, and in each one thing is changed: an operator, a comparison, a number, a truth
value, a condition, or a statement goes. Equations are not compiled (NUMBA_DISABLE_JIT=1), so that a
mutant takes seconds. Its module's own examples and the everyday tests that name the module judge
it, then the others of its room and of missions. They run without a mutant before: those that fail,
or take longer than two seconds uncompiled, are left out from then on; of the others the quickest
run, 30 s of either kind at most, until one fails. Some of what survives is the same program (`<`
for `<=` of a float, how far a search goes): read the list. All of it happens in a copy, one after
the other; put `nice` before it on a machine that has other work.
"""

import argparse
import ast
import json
import os
import random
import re
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from itertools import accumulate, islice
from operator import itemgetter
from pathlib import Path
from time import monotonic, sleep
from traceback import print_exc
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "bindusbl_des"

# What is changed.
ROOMS = {
    "equations": ("core/acoustics", "core/sea", "core/usbl", "core/vehicles"),
    "protocol": ("core/protocol",),
    "navigation": ("core/navigation",),
    "verification": ("apps/verification",),
    "selection": ("apps/planning/goals.py", "apps/planning/selecting.py"),
    "metrics": (
        "core/mission/service.py",
        "core/mission/metrics.py",
        "core/mission/tables.py",
    ),
}

# The everyday tests of a room, where these are not its folder and those of missions.
MISSIONS = ("tests/test_golden.py", "tests/mission", "tests/protocol/test_reception.py")
SELECTING = ("goals", "ranking", "selecting", "selecting_beside_others", "doubting", "sizes")
TESTS = {
    "sea": ("tests/sea", "tests/acoustics", *MISSIONS),
    "planning": tuple(f"tests/planning/test_{it}.py" for it in SELECTING),
    "verification": ("tests/verification",),
}

# A test that takes longer uncompiled is left out (s), and so is what the quicker ones leave no time
# for; what takes three times as long beside a mutant, and this, has no end.
LONGEST_TEST_S, BUDGET_S, LONGEST_S = 2.0, 30.0, 60.0

SWAPS = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "/", ast.Mod: "+",
    ast.Pow: "*", ast.Lt: ">=", ast.LtE: "<", ast.Gt: "<=", ast.GtE: ">", ast.Eq: "!=",
    ast.NotEq: "==", ast.Is: "is not", ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in",
    ast.And: "or", ast.Or: "and",
}  # fmt: skip
OPERATOR = re.compile(r"\*\*|//|[<>=!]=|[-+*/%<>]|\b(?:is not|not in|is|in|and|or)\b")
SKIPPED = ("annotation", "returns", "decorator_list")  # these compute nothing

# A plugin of pytest: how long each test takes, if it passes in time; or those alone, in that order.
PLUGIN = '''
import json, os, signal, time
from pathlib import Path
import pytest

KNOWN, LONGEST_S = Path(os.environ["MUTATIONS_TESTS"]), float(os.environ["MUTATIONS_LONGEST_S"])
UNTIL = time.monotonic() + float(os.environ["MUTATIONS_BUDGET_S"])
took = {}

def late(*_):
    raise TimeoutError("a test takes too long uncompiled")

@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    if KNOWN.exists():
        known = json.loads(KNOWN.read_text())
        config.hook.pytest_deselected(items=[it for it in items if it.nodeid not in known])
        items[:] = [it for it in items if it.nodeid in known]
        items.sort(key=lambda it: known[it.nodeid])

@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    if time.monotonic() > UNTIL and not KNOWN.exists():
        pytest.exit("enough of this file's tests are known", returncode=0)
    signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.0 if KNOWN.exists() else LONGEST_S)
    try:
        return (yield)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)

def pytest_runtest_logreport(report):
    if report.when == "call" and report.passed:
        took[report.nodeid] = report.duration
    elif not report.passed:
        took.pop(report.nodeid, None)

def pytest_sessionfinish():
    if not KNOWN.exists():
        KNOWN.write_text(json.dumps(took))
'''  # fmt: skip


class Mutant(NamedTuple):
    """A place in a file (bytes from `begin` to `end`), and what shall stand there."""

    file: Path
    line: int
    begin: int
    end: int
    new: str

    def __str__(self) -> str:
        text = (ROOT / self.file).read_bytes()
        line = text.splitlines()[self.line - 1].decode().strip()
        old = text[self.begin : self.end].decode().partition("\n")[0]
        return f"{self.file}:{self.line}: {old} -> {self.new}   {line}"


def mutants(file: Path) -> list[Mutant]:
    """Return all mutants of a file, which is named from the root of the repository."""
    text = (ROOT / file).read_bytes()
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def at(line: int, column: int) -> int:
        return starts[line - 1] + column

    def instead(node: ast.expr | ast.stmt, new: str) -> Mutant:
        end = at(node.end_lineno or 0, node.end_col_offset or 0)
        return Mutant(file, node.lineno, at(node.lineno, node.col_offset), end, new)

    def between(left: ast.expr, right: ast.expr, kind: ast.AST) -> Iterator[Mutant]:
        begin = at(left.end_lineno or 0, left.end_col_offset or 0)
        found = OPERATOR.search(text[begin : at(right.lineno, right.col_offset)].decode())
        if found and type(kind) in SWAPS:
            line = left.end_lineno or 0
            new = SWAPS[type(kind)]
            yield Mutant(file, line, begin + found.start(), begin + found.end(), new)

    def within(node: ast.AST) -> Iterator[Mutant]:
        if isinstance(node, ast.JoinedStr | ast.Raise | ast.Assert):
            return
        if isinstance(node, ast.BinOp):
            yield from between(node.left, node.right, node.op)
        elif isinstance(node, ast.BoolOp):
            yield from between(node.values[0], node.values[1], node.op)
        elif isinstance(node, ast.Compare):
            yield from between(node.left, node.comparators[0], node.ops[0])
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
            begin = at(node.lineno, node.col_offset)
            end = at(node.operand.lineno, node.operand.col_offset)
            yield Mutant(file, node.lineno, begin, end, "")
        elif isinstance(node, ast.If | ast.While):
            begin = at(node.test.lineno, node.test.col_offset)
            yield Mutant(file, node.test.lineno, begin, begin, "not ")
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield instead(node, repr(not node.value))
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            new = node.value + 1 if isinstance(node.value, int) else 1.125 * node.value or 0.125
            yield instead(node, repr(new))
        elif _is_removable(node):
            yield instead(node, "pass")
        for name, part in ast.iter_fields(node):
            for inner in part if isinstance(part, list) else [part]:
                if isinstance(inner, ast.AST) and name not in SKIPPED:
                    yield from within(inner)

    return list(within(ast.parse(text)))


def _is_removable(node: ast.AST) -> bool:
    """Tell whether a statement does something, and names nothing that others need."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Call)
    if isinstance(node, ast.Assign):
        return all(isinstance(it, ast.Attribute | ast.Subscript) for it in node.targets)
    return isinstance(node, ast.AugAssign | ast.Continue | ast.Break)


def drawn(count: int, seed: int, rooms: list[str]) -> list[Mutant]:
    """Return so many mutants, rooms in turn; every line that has some is as likely."""
    draw = random.Random(seed)
    places = []
    for parts in map(ROOMS.__getitem__, rooms):
        found = [ROOT / PACKAGE / it for it in parts]
        files = [it for part in found for it in (sorted(part.rglob("*.py")) or [part])]
        lines: dict[tuple[Path, int], list[Mutant]] = {}
        for it in (it for file in files for it in mutants(file.relative_to(ROOT))):
            lines.setdefault((it.file, it.line), []).append(it)
        chosen = draw.sample(sorted(lines), len(lines))
        places.append([draw.choice(lines[it]) for it in chosen])
    longest = max(map(len, places))
    return list(
        islice((room[k] for k in range(longest) for room in places if k < len(room)), count)
    )


class Copy:
    """A copy of the repository, in which mutants live."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "copy"
        ignored = shutil.ignore_patterns(".git", ".venv", "demo-results", "compiled")
        shutil.copytree(ROOT, self.root, ignore=ignored)
        (self.root / "mutations_plugin.py").write_text(PLUGIN)

    @cache  # noqa: B019 (there is one copy)
    def took(self, tests: str) -> dict[str, float]:
        """Return how long (s) each test of a file or folder takes that passes in time."""
        file = self.root / f"{tests.replace('/', '.')}.json"
        _, said = self._run([tests], file, (), 1e5)
        if not file.exists():
            sys.exit(f"{tests} does not run:\n{said}")
        found: dict[str, float] = json.loads(file.read_text())
        # the limit is one of processor time: tests that wait for other processes are left out too
        found = {name: lasts for name, lasts in found.items() if lasts < 10 * LONGEST_TEST_S}
        print(f"{tests}: {len(found)} tests, {sum(found.values()):.0f} s", flush=True)
        return found

    @cache  # noqa: B019
    def tests(self, module: Path) -> tuple[list[str], list[str]]:
        """Return a module for its own examples with the files of tests that name it, and the
        others of its room.
        """
        name = ".".join(module.with_suffix("").parts)
        found = (self.root / "tests").rglob("test_*.py")
        named = [it for it in found if it.stem == f"test_{module.stem}" or name in it.read_text()]
        first = [str(module), *sorted(str(it.relative_to(self.root)) for it in named)]
        room = module.parts[2]
        others = []
        for it in TESTS.get(room, (f"tests/{room}", *MISSIONS)):
            files = sorted((self.root / it).rglob("test_*.py")) or [self.root / it]
            others += [str(file.relative_to(self.root)) for file in files if file.exists()]
        return first, [it for it in dict.fromkeys(others) if it not in first]

    def killer(self, mutant: Mutant) -> str:
        """Return which test fails with a mutant, or ""."""
        path = self.root / mutant.file
        text = path.read_bytes()
        for files in filter(None, self.tests(mutant.file)):
            took = {name: lasts for it in files for name, lasts in self.took(it).items()}
            path.write_bytes(text[: mutant.begin] + mutant.new.encode() + text[mutant.end :])
            try:
                by = self._first_failure(files, took) if took else ""
            finally:
                path.write_bytes(text)
            if by:
                return by
        return ""

    def _first_failure(self, files: list[str], took: dict[str, float]) -> str:
        """Return which of the tests that take so long (s), in files, fails first, or "".

        The quickest are run, as many as take BUDGET_S together.
        """
        ends = accumulate(sorted(took.values()))
        asked = dict(
            islice(sorted(took.items(), key=itemgetter(1)), sum(it < BUDGET_S for it in ends))
        )
        file = self.root / "asked.json"
        file.write_text(json.dumps(asked))
        code, said = self._run(files, file, ("-x",), LONGEST_S + 3 * sum(asked.values()))
        if code == 0:
            return ""
        found = re.search(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE)
        return found[1] if found else "no end" if code < 0 else "does not even start"

    def _run(
        self, tests: list[str], file: Path, options: tuple[str, ...], longest_s: float
    ) -> tuple[int, str]:
        """Run tests in a copy of this process, which has imported what they import from others;
        return how it ended and what it said.
        """
        said = self.root / "said"
        if (child := os.fork()) == 0:
            os.chdir(self.root)
            into = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(into, 1)
            os.dup2(into, 2)
            os.environ |= {"MUTATIONS_TESTS": str(file), "PYTHONPATH": str(self.root)}
            sys.path[:0] = [str(self.root)]
            code = 3
            try:
                code = pytest.main(["-q", "-n", "0", "--doctest-modules", "-p", "no:cacheprovider",
                                    "-p", "mutations_plugin", *options, *tests])  # fmt: skip
            except BaseException:
                print_exc()
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(int(code))
        until = monotonic() + longest_s
        while monotonic() < until:
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended:
                return abs(os.waitstatus_to_exitcode(status)), said.read_text(errors="replace")
            sleep(0.05)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return -1, ""


def main() -> None:
    """Draw mutants as the command line says, and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first mutant")
    parser.add_argument("--rooms", nargs="+", choices=[*ROOMS], default=[*ROOMS])
    given = parser.parse_args()
    os.environ |= {
        "NUMBA_DISABLE_JIT": "1", "BINDUSBL_DES_CODE_CACHE_TOLD": "1",
        "MUTATIONS_LONGEST_S": str(LONGEST_TEST_S), "MUTATIONS_BUDGET_S": str(BUDGET_S),
    }  # fmt: skip
    sys.dont_write_bytecode = True
    for name in ("numba", "pandas", "pyarrow.parquet", "pydantic", "scipy.stats",
                 "simpy", "yaml"):  # fmt: skip
        import_module(name)
    killed = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder))
        chosen = drawn(given.first + given.count, given.seed, given.rooms)[given.first :]
        for number, mutant in enumerate(chosen, start=given.first):
            began = monotonic()
            by = copy.killer(mutant)
            killed += bool(by)
            how = f"killed ({monotonic() - began:.0f} s)" if by else "SURVIVED"
            print(f"{number} {how}: {mutant}   {by}", flush=True)
    print(f"{killed} of {len(chosen)} mutants are killed")


if __name__ == "__main__":
    main()
