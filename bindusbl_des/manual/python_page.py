"""The page on Python: every public name, from its own signature and docstring."""

import inspect
from collections.abc import Iterator
from functools import cached_property
from importlib import import_module
from typing import Any, NamedTuple

from ..scenario.families import FAMILIES
from .docstrings import told

HEAD = """\
# Python

Written by `python -m bindusbl_des.manual python` from the docstrings of the package. Everything
here is imported from `bindusbl_des`, unless its section says otherwise. Units are in the names,
else in the text; arrays are numpy's, tables pandas'.

```python
from bindusbl_des import simulate, sweep

result = simulate("scenarios/quickstart.yaml", seed=1)
print(result.summary())                                      # the table of `run`
print(result.auvs[["auv", "fixes", "position_error_m"]])     # all metrics, a row per AUV
result.plot("trajectory", "map.png")                         # any figure of `plot`
result.report("report.html")                                 # the page of `run`

campaign = sweep("scenarios/quickstart.yaml", vary={"asvs.count": [1, 2, 3]}, seeds=4)
print(campaign.summary())                                    # the table of `sweep`
print(campaign.missions.groupby("asvs.count").worst_position_error_m.mean())
```

In a notebook the last line of a cell shows a scenario, a result, a campaign or a figure by itself.
"""


class Section(NamedTuple):
    """A section of the page: its title, what it is about, and its names."""

    title: str
    about: str
    names: tuple[str, ...]


RUNNING = Section(
    "Running", "",
    ("simulate", "sweep", "resume", "plan", "load_scenario", "load_result", "load_campaign",
     "compare", "advise", "cautions", "limits", "verify"),
)  # fmt: skip
HELD = Section(
    "What one holds", "",
    ("Scenario", "ScenarioError", "Result", "Campaign", "CampaignInterrupted", "Plan", "Verdict",
     "Mission"),
)  # fmt: skip

# What parts of one's own are called with, or answer
VIEWS = (
    "View", "TimedGroups", "BroadcastView", "Slot", "Signals", "Sounding", "PlanView", "AnchorView",
    "WayView",
)  # fmt: skip

# What a mission shows of itself, and what navigators and downlinks offer and are handed
SHOWN = ("mission.looking:AuvStates", "mission.looking:PingUnderWay")
INTERFACES = (
    "navigation.navigators:Navigator", "navigation.dead_reckoning:DeadReckoning",
    "navigation.dead_reckoning:Odometry", "protocol.network:Network", "protocol.network:Turn",
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
    known = {*RUNNING.names, *HELD.names, *VIEWS}
    rest = tuple(name for name in PUBLIC.__all__ if name not in known)
    lines = [
        *_section(RUNNING),
        *_section(HELD),
        *(line for home in SHOWN for line in _entry(_at(home))),
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
    for family in FAMILIES:
        ships = ", ".join(f"`{name}`" for name in family.siblings)
        yield f"| `{family.key}` | `({', '.join(family.arguments)})` | {ships} |"
    yield ""
    for name in VIEWS:
        yield from _entry(getattr(PUBLIC, name))
    for home in INTERFACES:
        yield from _entry(_at(home))


def _vehicles() -> Iterator[str]:
    yield "## Vehicles alone\n"
    models = ", ".join(f"`{name}`" for name in DYNAMICS.MODELS)
    yield f"From `bindusbl_des.dynamics`; the models are {models}.\n"
    for name in DYNAMICS.__all__:
        thing = getattr(DYNAMICS, name)
        if callable(thing):
            yield from _entry(thing)


def _at(home: str) -> Any:
    """Return a class of the package by its module and name."""
    module, _, name = home.partition(":")
    return getattr(import_module(f"bindusbl_des.{module}"), name)


def _entry(thing: Any) -> Iterator[str]:
    yield f"### {thing.__name__}\n"
    if not inspect.isclass(thing) or thing in MADE:
        yield f"`{thing.__name__}{_signature(thing)}`\n"
    yield from told(thing).markdown()
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
        yield f"| {name} | {told(member).in_one().replace('|', chr(92) + '|')} |"
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
    arrow = f" -> {returned}" if hasattr(PUBLIC, returned or "-") else ""
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
