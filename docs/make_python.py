"""The page on Python, from signatures and docstrings.

python docs/make_python.py > docs/python.md
"""

import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, NamedTuple

from bindusbl_des.core.scenario.families import FAMILIES
from bindusbl_des.support.facts import cached_property

# What a docstring says, as Markdown.


# A role of reST: what it names is written as code.
ROLE = re.compile(r":\w+:`[~.]*([^`]+)`")
RAISED = re.compile(r"^ {4}(\w+): ", re.MULTILINE)


@dataclass
class Docstring:
    """What a docstring says: paragraphs, which errors are raised, and an example."""

    paragraphs: list[str] = field(default_factory=list)
    raised: list[str] = field(default_factory=list)
    example: str = ""

    def markdown(self, paragraphs: int) -> Iterator[str]:
        """Yield it as lines: so many paragraphs, what is raised, a block of code."""
        for paragraph in self.paragraphs[:paragraphs]:
            yield f"{paragraph}\n"
        if self.raised:
            yield f"Raises {', '.join(f'`{error}`' for error in dict.fromkeys(self.raised))}.\n"
        if self.example:
            yield f"```pycon\n{self.example}\n```\n"

    def in_one(self) -> str:
        """Return its first sentence, for a cell of a table."""
        return re.split(r"(?<=\.) (?=[A-Z`])", " ".join(self.paragraphs), maxsplit=1)[0]


def docstring(thing: Any) -> Docstring:
    """Return what the docstring of something says.

    >>> def f(): "Give ``1`` of :func:`.g`.\\n\\nRaises:\\n    ValueError: never,\\n        ever."
    >>> docstring(f).in_one(), docstring(f).raised
    ('Give `1` of `g`.', ['ValueError'])
    """
    found = Docstring()
    for part in (inspect.getdoc(thing) or "").split("\n\n"):
        if part.startswith(">>>"):
            found.example = re.sub(r" *# doctest:.*", "", f"{found.example}\n{part}".strip())
        elif part.startswith("Raises:"):
            found.raised += RAISED.findall(part)
        else:
            found.paragraphs.append(_flowing(part))
    return found


def _flowing(text: str) -> str:
    """Return a paragraph in one line, without reST, and without what HTML would take for its own.

    >>> _flowing("``a`` < :class:`.b.C`\\n  is *args")
    '`a` &lt; `C` is \\\\*args'
    """
    flat = ROLE.sub(lambda role: f"`{role[1].split('.')[-1]}`", " ".join(text.split()))
    pieces = flat.replace("``", "`").split("`")
    prose = (piece.replace("<", "&lt;").replace("*", r"\*") for piece in pieces[::2])
    return "`".join(
        word
        for pair in zip(prose, [*pieces[1::2], None], strict=True)
        for word in pair
        if word is not None
    )


# The page on Python: every public name, from its own signature and docstring.


HEAD = """\
# Python

After this page you can run, plan and read missions from Python, and know what parts of your own
are called with. Import everything from `bindusbl_des`, unless a section says otherwise. Units are
in the names, else in the text; arrays are numpy's, tables pandas'. `help(name)` gives settings and
errors in full. (Written by `python docs/make_python.py`.)

```python
from bindusbl_des import simulate, sweep

result = simulate("scenarios/quickstart.yaml", seed=1)
print(result.summary())                                      # the table of `run`
print(result.auvs[["auv", "fixes", "position_error_m"]])     # all metrics, a row per AUV
result.plot("trajectory", "map.png")                         # any figure of `plot`
result.report("report.html")                                 # the page of `run`

campaign = sweep("scenarios/quickstart.yaml", vary={"asvs.count": [1, 2, 3]}, seeds=4)
print(campaign.summary())                                    # the table of `sweep`
points = campaign.points                                     # mean, low, high, n of all metrics
print(points[points.metric == "worst_position_error_m"])
print(campaign.to_latex())                                   # the same for a paper
```

Notebooks display scenarios, results, campaigns and figures: [examples](index.md#notebooks).
"""


class Section(NamedTuple):
    """A section of the page: its title, what it is about, and its names."""

    title: str
    about: str
    names: tuple[str, ...]


RUNNING = Section(
    "Running", "",
    ("simulate", "sweep", "resume", "plan", "load_scenario", "load_result", "load_campaign",
     "compare", "advise", "warnings_of", "limits", "verify"),
)  # fmt: skip
HELD = Section(
    "What one holds", "",
    ("Scenario", "Setup", "ScenarioError", "Result", "Campaign", "CampaignState",
     "CampaignInterrupted", "Plan", "Verdict", "Mission"),
)  # fmt: skip

MEASURED = Section(
    "What is measured", "From logs ([replay](replay.md)), and by the instruments of a mission as "
    "it is advanced ([live](live.md)).",
    ("read_log", "replay", "fit", "Instruments"),
)  # fmt: skip

# What parts of one's own are called with, or answer
VIEWS = (
    "View", "TimedGroups", "BroadcastView", "Slot", "Signals", "Sounding", "PlanView", "AnchorView",
    "WayView",
)  # fmt: skip

# What a mission shows of itself, and what navigators and downlinks offer and are handed
SHOWN = ("AuvStates", "PingUnderWay", "Modem")
INTERFACES = (
    "Navigator", "DeadReckoning", "Odometry", "Network", "Turn", "ping_group", "broadcast",
    "downlink_free", "until",
)  # fmt: skip

# A default that is longer is not written.
LONGEST_DEFAULT = 24

# The package as its users see it
PUBLIC = import_module("bindusbl_des")
DYNAMICS = import_module("bindusbl_des.dynamics")

# Classes that users make themselves
MADE = (PUBLIC.Scenario, PUBLIC.Mission, DYNAMICS.Fleet)


def python_page() -> str:
    """Return the page: what runs, what one holds, parts of one's own, vehicles, equations."""
    known = {*RUNNING.names, *HELD.names, *SHOWN, *MEASURED.names, *VIEWS, *INTERFACES}
    rest = tuple(name for name in PUBLIC.__all__ if name not in known)
    lines = [
        *_section(RUNNING),
        *_section(HELD),
        *(line for name in SHOWN for line in _entry(getattr(PUBLIC, name))),
        *_section(MEASURED),
        *_families(),
        *_vehicles(),
        *_section(Section("Equations", "Those of the model, to be used alone.", rest)),
    ]
    return "\n".join([HEAD, *lines]).rstrip() + "\n"


def _section(section: Section) -> Iterator[str]:
    yield f"## {section.title}\n"
    if section.about:
        yield f"{section.about}\n"
    for name in section.names:
        yield from _entry(getattr(PUBLIC, name))


def _families() -> Iterator[str]:
    yield "## Parts of one's own\n"
    yield (
        "A part of the mission is named in the scenario, by the name of one that ships or as "
        "`module:object`; in Python the object itself can be given. [Extending](extending.md) has "
        "an example of each.\n"
    )
    yield "| key | is called with | those that ship |"
    yield "| --- | --- | --- |"
    for family in (it for it in FAMILIES if it.is_open):
        ships = ", ".join(f"`{name}`" for name in family.siblings)
        yield f"| `{family.key}` | `({', '.join(family.arguments)})` | {ships} |"
    yield ""
    for name in (*VIEWS, *INTERFACES):
        yield from _entry(getattr(PUBLIC, name))


def _vehicles() -> Iterator[str]:
    yield "## Vehicles alone\n"
    models = ", ".join(f"`{name}`" for name in DYNAMICS.MODELS)
    yield f"From `bindusbl_des.dynamics`; the models are {models}.\n"
    for name in DYNAMICS.__all__:
        thing = getattr(DYNAMICS, name)
        if callable(thing):
            yield from _entry(thing)


def _entry(thing: Any) -> Iterator[str]:
    yield f"### {thing.__name__}\n"
    if not inspect.isclass(thing) or thing in MADE:
        yield f"`{thing.__name__}{_signature(thing)}`\n"
    yield from docstring(thing).markdown(2 if thing.__name__ in RUNNING.names else 1)
    if inspect.isclass(thing):
        yield from _members(thing)


def _members(kind: type) -> Iterator[str]:
    """Yield a table of what a class offers, where it offers anything."""
    rows = [
        (f"`{name}{_signature(member)}`" if inspect.isfunction(member) else f"`{name}`", member)
        for name, member in vars(kind).items()
        if not name.startswith("_")
        and (inspect.isfunction(member) or isinstance(member, property | cached_property))
    ]
    if not rows:
        return
    yield "| member | is |"
    yield "| --- | --- |"
    for name, member in rows:
        yield f"| {name} | {docstring(member).in_one().replace('|', chr(92) + '|')} |"
    yield ""


def _signature(thing: Any) -> str:
    """Return the parameters as one calls them: without `self`, types and long defaults."""
    asked = inspect.signature(thing)
    shown = [
        it.replace(annotation=inspect.Parameter.empty, default=_Written.of(it.default))
        for it in asked.parameters.values()
        if it.name != "self"
    ]
    returned = asked.return_annotation
    if not isinstance(returned, str):  # as of what is loaded when it is needed
        returned = getattr(returned, "__name__", "")
    arrow = f" -> {returned}" if returned in PUBLIC.__all__ else ""
    return str(inspect.Signature(shown)).replace(" = ", "=") + arrow


class _Written(str):
    """A default as it is written."""

    __slots__ = ()
    __repr__ = str.__str__

    @classmethod
    def of(cls, default: Any) -> Any:
        """Return a default as one writes it, or dots where that is long or a name of ours."""
        if default is inspect.Parameter.empty:
            return default
        text = repr(default)
        return cls(text if len(text) <= LONGEST_DEFAULT else "...")


if __name__ == "__main__":
    print(python_page(), end="")
