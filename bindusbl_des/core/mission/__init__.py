"""One mission: its world built from a scenario, run by the event kernel, sampled and measured.

Theory of operation
-------------------
`build.build_world` builds, from the facts of a `Setup` and the streams of a seed: vehicles and
navigators (`launch`), the errors of sensors (`sensor_errors`), modems that outside hosts control
(`modems`), the network, and the record.  Here, and nowhere later, keys of the scenario choose
between objects: who pings, what answers, which navigator; later code asks the objects.

`mission.Mission` holds the SimPy environment; it can be advanced to any instant, looked at, and
advanced again; `simulation.simulate` does that once, to the end.  The result is the same, bit for
bit: events happen at computed instants, and what is worked out when it is asked for does not depend
on when that is.

A mission covers [0, duration).  What would happen at its last instant does not; pings and fixes
that are under way then are recorded as in flight.  After an error it cannot go on.

What may be asked when
----------------------
Between events, at the instant that the mission has been advanced to: truth, estimate and covariance
of each AUV, with all fixes delivered by then; positions of ASVs; pings under way and frames on the
air.  Any code may wait for the event of a happening, which changes nothing.

After the end
-------------
The kernel decides, the record stores rows, and nothing in this room judges them: warnings, verdicts
and explanations belong to applications that read tables and a `Setup`.

After the last event the AUVs' tracks, estimates and errors are worked out at the rates that
`record` sets (`trajectories`, `tables`), then metrics: of each AUV its fixes and the errors of its
estimate (`service`), of the mission and its worst AUV (`metrics`).  Estimates between fixes are
formulas, so a rate changes the number of samples and not their values.

Invariants
----------
* Noise belongs to a purpose and its vehicles: the same seed gives another mission the same drift.
* What no seed changes, routes, stations, motions of hulls, is worked out once for all missions of a
  scenario (`launch`).
* A metric is a number, or none where an AUV has no data for it; NaN ends the run.
"""
