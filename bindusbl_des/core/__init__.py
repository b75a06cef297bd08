"""The core: what a mission is, and everything that happens in one.

Read it in this order; the head of each room tells how it works.

`scenario` and `setup` say what a mission is to be: keys, and the facts that follow from them.
`vehicles`, `geometry`, `sea` and `acoustics` are the world: where everything is, and how sound
gets from one vehicle to another.  `protocol` decides who sounds when, on the event kernel.  `usbl`
makes a measurement of what was heard and a fix of the measurements; `navigation` corrects the
estimate of an AUV by it.  `mission` puts them together and runs them; `records` and `results` are
what remains: rows, tables, metrics.

The core names no part that ships but by the text of `scenario.families`; parts are in `..models`,
what reasons about missions in `..apps`, what knows nothing of the sea in `..support`.
"""
