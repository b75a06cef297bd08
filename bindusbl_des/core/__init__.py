"""The core: what a mission is, and everything that happens in one.

Read it in this order; the head of each room tells how it works.

`scenario` and `setup` say what a mission is to be: keys, and the facts that follow from them.
`vehicles`, `geometry`, `sea` and `acoustics` are the world: where everything is, and how sound gets
from one vehicle to another.  `protocol` decides who sounds when, on the event kernel.  `usbl`
measures the sound that was heard and makes a fix of the measurements; `navigation` corrects an
AUV's estimate by the fix.  AUVs that range each other do so by `protocol.peers`, and correct each
other by `navigation.team`.  `mission` builds these and runs them; `records` and `results` keep what
comes out: rows, tables, metrics.

Of the parts that ship, downlinks (`protocol.downlinks`), routes and placements
(`scenario.sections`), hulls (`vehicles.hulls`) and filters (`navigation`) are in the core; the
others are in `..models`, and the core names them by the text of `scenario.families` alone; what
reads charts and data sheets (`..models.charts`, `..models.presets`) lies below it.  What
reasons about missions is in `..apps`, what knows nothing of the sea in `..support`.

Numbers are worked out by functions that are `@compiled` by numba (`..support.compiled`).  Where
such a function has a parameter `packed`, that is the address of a NamedTuple of numbers and arrays,
which the function opens by `unpacked(packed, Class)` (`..support.packed`); a buffer that grows lies
elsewhere then, and `renew` registers the new array.
"""
