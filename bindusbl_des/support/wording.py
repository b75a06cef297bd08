"""Wording of messages: the nearest known spelling, values as users write them, rounded numbers."""

import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from hashlib import sha256
from json import dumps
from math import floor, isfinite, log10
from string import ascii_uppercase
from textwrap import fill
from typing import Any, NamedTuple, NoReturn
from unicodedata import category

# Messages shorten longer values, to stay one readable line.
LONGEST_VALUE = 60

# Longest text of an error and of its traceback, which may be of any length.
LONGEST_ERROR, LONGEST_TRACE = 2000, 20_000

# No table and no sentence is wider than a terminal.
WIDEST = 80

# No number is shown with more decimals: beyond them is only rounding.
MOST_DECIMALS = 6
FINEST = 0.5 * 10**-MOST_DECIMALS

# Relative difference below which two numbers differ only by rounding.
ROUND_OFF = 1e-9


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that was most likely meant, or None.

    A missing or wrong unit comes first (depth, depth_km, dpth -> depth_m), then a word that
    contains it, then similar letters.

    >>> nearest("depth", ["death_m", "depth_m"]), nearest("error", ["position_error_m", "terror"])
    ('depth_m', 'position_error_m')
    """
    words = list(known)
    asked = str(word).lower().replace("-", "_").replace(" ", "_")
    stem = asked.rpartition("_")[0] or asked
    by_unit = [name for name in words if name.startswith(f"{asked}_")]
    by_unit += [name for name in words if name.startswith(f"{stem}_")] if stem != asked else []
    # A word spelled almost right (radius_n) beats one that only begins alike.
    by_part = [name for name in words if f"_{asked}_" in f"_{name}_"]
    almost = [
        match for match in get_close_matches(asked, words, n=1, cutoff=0.9) if match[0] == asked[:1]
    ]
    near = almost or by_unit or by_part
    if near:
        return near[0]
    beginnings = {
        "_".join(name.split("_")[:length]): name
        for name in reversed(words)
        for length in range(1, name.count("_") + 1)
    }
    begun = [beginnings[part] for part in get_close_matches(asked, beginnings, n=1, cutoff=0.8)]
    close = begun or get_close_matches(asked, words, n=1, cutoff=0.6)
    return close[0] if close else None


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest known word, or an empty string.

    >>> did_you_mean("frequncy_khz", ["frequency_khz", "depth_m"])
    "; did you mean 'frequency_khz'?"
    """
    near = nearest(word, known)
    return f"; did you mean {near!r}?" if near else ""


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table, its first column aligned left, the others right.

    >>> aligned([("AUV", "error"), ("0", "1.25")])
    ['AUV  error', '0     1.25']
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            (row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])),
        ).rstrip()
        for row in rows
    ]


def plain(value: object) -> str:
    """Return a value as users write it in a scenario file.

    >>> plain((None, True, 140.0, "otter")), plain([{"asv": 1, "at_s": 150.0}])
    ('[null, true, 140, otter]', '[{asv: 1, at_s: 150}]')
    """
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value).removesuffix(".0")
    if isinstance(value, list | tuple):
        return f"[{', '.join(plain(item) for item in value)}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{name}: {plain(item)}' for name, item in value.items())}}}"
    return str(value)


def described(value: object) -> str:
    """Describe a wrong value, for a message.

    >>> described("12:30"), described(None), described([1])
    ("the text '12:30'", 'nothing', 'a list')
    """
    if value is None:
        return "nothing"
    if isinstance(value, str):
        return f"the text {shortened(repr(value))}"
    if isinstance(value, list | tuple):
        return "a list"
    if isinstance(value, dict):
        return "keys and values"
    return shortened(plain(value))


def printable(text: str) -> str:
    r"""Return a text with escapes for characters that a terminal would obey or cannot show.

    >>> printable("a\0b\x1b[31m"), printable("\udcff.yaml")
    ('a\\x00b\\x1b[31m', '\\udcff.yaml')
    """
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in text)


def printable_lines(text: str) -> str:
    r"""Return a text of several lines with each line made printable.

    >>> printable_lines("a\x9b31m\nb\r")
    'a\\x9b31m\nb\\r'
    """
    return "\n".join(map(printable, text.split("\n")))


def printable_json(text: str) -> str:
    r"""Return a JSON text, its data unchanged, with escapes for what a terminal would obey.

    >>> printable_json('"a\x9b31m\u202e"')
    '"a\\u009b31m\\u202e"'
    """
    return "".join(
        sign if sign.isprintable() or sign == "\n" else dumps(sign)[1:-1] for sign in text
    )


def file_name(name: str) -> str:
    """Return a name as a file or folder name: letters of any script, digits, _ . and -, at most 200
    bytes.  If other characters, or the end, are lost, a hash tells such names apart.

    >>> file_name("two AUVs"), file_name("\u043b\u043e\u0434\u043a\u0430/1")
    ('two_AUVs', '\u043b\u043e\u0434\u043a\u0430_1')
    >>> file_name("\u2693"), file_name("\u26f5")
    ('_-6856f38f', '_-31c70f82')
    """
    kept = "".join(sign if sign in "_.-" or category(sign)[0] in "LMN" else " " for sign in name)
    whole = "_".join(re.split(" +", kept)).encode()
    short = whole[:200].decode(errors="ignore")
    is_whole = len(whole) <= 200 and all(
        sign.isascii() for sign, left in zip(name, kept, strict=True) if left == " "
    )
    return short if is_whole else f"{short}-{sha256(name.encode()).hexdigest()[:8]}"


def shortened(text: str, most: int = LONGEST_VALUE) -> str:
    """Return a text cut to a length, by default one that fits into a message.

    >>> shortened("ranges are missing", 10)
    'ranges...g'
    """
    return text if len(text) <= most else f"{text[: most - 4]}...{text[-1]}"


def significant(value: float, digits: int = 3) -> str:
    """Return a number with `digits` significant digits, without exponent; "-" if not finite.

    >>> significant(231.4, 2), significant(0.05349), significant(5.3e-15), significant(float("nan"))
    ('231', '0.0535', '0', '-')
    """
    if not isfinite(value):
        return "-"
    if abs(value) < FINEST:
        return "0"
    whole = floor(log10(abs(value))) + 1
    return f"{value:.{min(max(digits - whole, 0), MOST_DECIMALS)}f}"


def number(value: float | None, digits: int = 2, factor: float = 1.0) -> str:
    """Return a number with fixed decimals; "-" if it is not known, and "0" only if it is zero.

    >>> number(0.8342, 1, 100), number(None), number(float("nan")), number(0.0042), number(0.0)
    ('83.4', '-', '-', '0.0042', '0.00')
    """
    if value is None or value != value:
        return "-"
    text = f"{value * factor:.{digits}f}"
    return text if float(text) or abs(value * factor) < FINEST else significant(value * factor, 2)


class Shown(NamedTuple):
    """A metric as a column of tables; its values times `factor` are in `unit`."""

    words: str
    unit: str
    metric: str
    digits: int
    factor: float = 1

    def number_in(self, metrics: Mapping[str, Any]) -> str:
        """Return the metric's value in a table of metrics by name; a dash if it is missing."""
        return number(metrics.get(self.metric), self.digits, self.factor)


def decimals(*scales: float, digits: int = 2) -> int:
    """Return the decimals that show the first finite scale above zero to `digits` digits.

    >>> decimals(0.035), decimals(float("nan"), 12.0), decimals(0.0), decimals(0.035, digits=1)
    (3, 0, 3, 2)
    """
    known = [value for value in scales if isfinite(value) and value > 0]
    return min(max(digits - 1 - floor(log10(known[0])), 0), MOST_DECIMALS) if known else 3


def with_half(mean: float, half: float) -> tuple[str, str]:
    """Return a mean and half its interval with as many decimals as give the latter two digits.

    What is not known is "-".

    >>> with_half(0.9224, 0.0351), with_half(264.43, 0.013), with_half(5.0, 0.0)
    (('0.922', '0.035'), ('264.430', '0.013'), ('5.00', '0'))
    >>> with_half(0.5, 2e-8), with_half(0.5, float("nan"))
    (('0.500000', '<0.000001'), ('0.500', '-'))
    """
    if not isfinite(half) or half <= ROUND_OFF * abs(mean):
        return significant(mean), "0" if isfinite(half) else "-"
    places = decimals(half)
    known = f"{half:.{places}f}" if half >= FINEST else f"<{10**-MOST_DECIMALS:.{MOST_DECIMALS}f}"
    return f"{mean:.{places}f}", known


def plus_minus(mean: float, half: float) -> str:
    """Return a mean and half its interval as one text; the mean alone if that is not known.

    >>> plus_minus(0.9224, 0.0351), plus_minus(0.5, float("nan"))
    ('0.922 +- 0.035', '0.500')
    """
    return " +- ".join(with_half(mean, half)) if isfinite(half) else significant(mean)


def with_ends(mean: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a mean and the ends of its interval: three digits, or more to tell the ends apart.

    >>> with_ends(0.785, 0.764, 0.806), with_ends(0.785, 0.78462, 0.78538)
    (('0.785', '0.764', '0.806'), ('0.7850', '0.7846', '0.7854'))
    """
    half, digits = (high - low) / 2, 3
    if isfinite(half) and half > 0 and isfinite(mean) and mean:
        digits = max(3, floor(log10(abs(mean))) - floor(log10(half)) + 1)
    return significant(mean, digits), significant(low, digits), significant(high, digits)


def amount(value: float) -> str:
    """Return a sum with separators of thousands.

    >>> amount(25000.0), amount(1.5)
    ('25,000', '1.5')
    """
    return f"{value:,.2f}".rstrip("0").removesuffix(".")


def filled(text: str, indent: str = "") -> str:
    """Return a text in lines as wide as tables; all but the first are indented."""
    return fill(
        text, WIDEST, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def counted(count: int, noun: str) -> str:
    """Return a count with its noun.

    >>> counted(1, "ping"), counted(0, "ping")
    ('1 ping', '0 pings')
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def lettered(number: int) -> str:
    """Return the letter of the first, second, ... of several, by index.

    >>> lettered(0), lettered(25), lettered(26)
    ('A', 'Z', 'A1')
    """
    return f"{ascii_uppercase[number % 26]}{number // 26 or ''}"


def refuse(name: str, value: object, rule: str, remedy: str) -> NoReturn:
    """Raise ValueError: the value of `name` breaks a rule; with a remedy."""
    raise ValueError(f"{name} must {rule}; met {value}; {remedy}")


# Longer times (s) are written in hours and minutes.
LONG_S = 600.0


def timed(seconds: float | None, digits: int = 0) -> str:
    """Return a time with its unit: in seconds, from ten minutes on in hours and minutes.

    >>> timed(231.42, 1), timed(13_529.0, 1), timed(None)
    ('231.4 s', '3:45 h', '-')
    """
    if seconds is None or not abs(seconds) >= LONG_S:
        return "-" if number(seconds, digits) == "-" else f"{number(seconds, digits)} s"
    hours, minutes = divmod(round(seconds / 60.0), 60)
    return f"{hours}:{minutes:02d} h"


def instant(seconds: float, duration_s: float) -> str:
    """Return an instant of a mission: in seconds, or as h:mm:ss from ten minutes' duration on.

    >>> instant(231.42, 300.0), instant(7_009.4, 14_222.0)
    ('231 s', '1:56:49')
    """
    if duration_s < LONG_S:
        return f"{seconds:.0f} s"
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def spoken(seconds: float) -> str:
    """Return a time with one unit, as people say it.

    >>> spoken(40.0), spoken(7200.0), spoken(1e9)
    ('40 s', '2 h', '32 years')
    """
    for unit, length, upto in (("s", 1.0, 120), ("min", 60.0, 120), ("h", 3600.0, 48)):
        if seconds < upto * length:
            return f"{seconds / length:.0f} {unit}"
    days = seconds / 86_400
    return f"{days:.0f} days" if days < 730 else f"{days / 365.25:.2g} years"
