"""Values that programs stumble over: of data, of YAML, of command lines."""

import math
from typing import Any

from commands_for_tests import params

# All keys of scenarios, with those of their parts
KEYS = tuple(dict.fromkeys(row["key"] for row in params()))

# What stands where something else belongs, in any nested data.
VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 17, -0.0, 0.5, 1e-9, 1e-300, 5e-324, 1e5, 1e9, 1e300, -1e300,
    math.inf, -math.inf, math.nan, 2**31, 2**63, -(2**63), 10**18, 10**30, int("9" * 400),
    "", " ", "0", "nan", "none", "\n", "a\tb", "\x07\x1b[31m", "\u202eabc", "\ufeff", "\u2028",
    "😀", "ä" * 300, "x" * 5000, "../../up", "/dev/null", "a/b", ".", "..", "json:loads",
    "nowhere:at_all", "bindusbl_des:nothing", ":", "a:", "<script>alert(1)</script>", "]]>", "%s{}",
    [], {}, [[]], [None], [0], [0, 0], [1, 2, 3], [[0, 0], [1e300, -1e300]], ["a", "b"], {"a": 1},
    {"kind": "hold"}, {"model": "otter"}, {"": {}}, [[math.nan, math.inf]], [[0, 0]] * 100,
)  # fmt: skip

# Numbers alone, which are more often let through.
NUMBERS: tuple[Any, ...] = tuple(it for it in VALUES if isinstance(it, int | float))

# Numbers that belong in many a place, at the ends of their ranges or beside them.
LIKELY = (
    0,
    1,
    2,
    3,
    0.0,
    0.001,
    0.01,
    0.1,
    0.5,
    1.0,
    10.0,
    89.0,
    90.0,
    100.0,
    180.0,
    1e3,
    1e4,
    1e6,
)

# YAML that stands for no plain value, or for one in an odd way.
YAML = (
    "!!python/object/apply:os.getcwd []", "!!python/name:os.system", "!!binary aGFsbG8=", "!own 1",
    "!!set {a, b}", "&a 1", "*a", "&a [*a]", "&a {b: *a}", "<<: {a: 1}", "{<<: {a: 1}}", "1_000",
    "0x1F", "0o17", "010", "12:30", "2024-01-02", "yes", "on", "~", ".NaN", "-.inf", "1e999", "+5",
    "1,5", "5 m", "'", '"', "[1, 2", "{a: ", "- 1", "? [1]\n: 2", "|\n  text", ">\n  text", "@",
    "`", "%", "- - - 1", "a: b: c", "'\\0'", '"\\0"', '"\\ud800"', '"\\e[31m"', "\t1", "# nothing",
    "...", "\n---\nname: second", "[" * 30 + "]" * 30, "[" * 3000, "{a: " * 200,
    "[" + "0, " * 2000 + "0]",
    "{" + ", ".join(f"k{n}: {n}" for n in range(500)) + "}",
)  # fmt: skip

# Nine levels of nine aliases each: a file of some hundred bytes that would become a gigabyte.
BOMB = "".join(f"b{n}: &b{n} [{', '.join([f'*b{n - 1}' if n else 'ha'] * 9)}]\n" for n in range(10))

# What stands in a command line where a number, a word or the name of a file belongs.
WORDS = (
    "", " ", "0", "1", "2", "-1", "-0", "3.5", "1e3", "1e300", "nan", "inf", "-inf", "9" * 400, "x",
    "\0", "a\0b", "x" * 300, "x" * 5000, "ä" * 200, "\udcff\udcfe.yaml", "😀", "\u202e", "\x1b[31m",
    "a\nb", "*", "[", "(", "%s", "{}", "=", "a=b", "--", "-", "--help", "~", "null", "true",
    "[1,2]", "1/2", "2/1", "0/0", "1/999999999", "dask:", "dask:nowhere", "json:loads", "../..",
)  # fmt: skip

# Names of files that are there, and of some that cannot be.
PATHS = (
    "scenario.yaml", "experiment.yaml", "track.csv", "run", "campaign", "empty", "missing", "null",
    "full", "scenario.yaml/below", "run/run.json", "missing/below.png", "new.png", "new.svg",
    "new.csv", "new.parquet", "new.html", "new", ".", "loop", "dangling",
)  # fmt: skip
