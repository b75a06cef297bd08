"""A scenario: the keys of a mission as frozen data, what they mean, and what they must agree on.

Theory of operation
-------------------
**Layers.**  `sections` declares the keys, one pydantic model for each section; a key carries its
unit, range, default, description and source.  `scenario_keys.ScenarioKeys` holds all sections.
`scenario.Scenario` adds the agreement between keys.  `files` reads and writes scenarios as YAML.
Nothing below `files` knows of files, clocks or random numbers.

**Parts.**  A key such as `protocol.schedule` names a part of a family (:mod:`.families`).  The
scenario stores its name and settings (:mod:`.part_choice`), and code asks what the part declares.

**Validation** has three steps.  (1) pydantic checks each key by itself.  (2) `Scenario` makes a
`Site` of the keys and asks each function of `agreement` for `Problem`s: key, message with remedy,
and the other keys involved.  (3) :mod:`.files.explanations` words pydantic's errors.  To report
every mistake at once, :mod:`.files.scenario_file` removes wrong values and validates again; a
contradiction that involves a removed value is left out, since it may vanish with the mistake.

**Facts.**  `site.Site` derives facts from the keys: area, stations, routes, plans, sound speed.  A
fact is computed when it is first asked for and then kept.  Facts that need numpy import it
themselves, so that `validate` stays fast.  `setup.Setup` adds facts that need sound or the
protocol.

**Given or default.**  A data sheet (`preset`, `modem`) replaces defaults, never a key that the user
gave; what it replaces does not count as given, so that a scenario is written back as it was read.

Invariants: a scenario never changes; equal scenarios with equal seeds are equal missions.
"""
