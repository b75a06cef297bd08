"""One mission: its world built from a scenario, run by the event kernel, sampled and measured.

Theory of operation
-------------------
`build.build_world` puts together, of the facts of a `Setup` and the streams of a seed: vehicles
(`launch`), what makes their sensors wrong (`sensor_errors`), what they carry (`onboard`), the
network, and the record.  Here, and nowhere later, keys of the scenario choose between objects: who
pings, what answers, which navigator; what was built differently answers differently.

`mission.Mission` holds the SimPy environment; it can be advanced to any instant, looked at, and
advanced again; `simulation.simulate` does that once, to the end.  The result is the same, bit for
bit: events happen at computed instants, and whatever else is worked out when somebody looks comes
to the same whenever it is.

A mission covers [0, duration).  What would happen at its last instant does not; pings and fixes
that are under way then are recorded as in flight.  After an error it cannot go on.

What may be asked when
----------------------
Between events, at the instant that the mission has been advanced to: truth, estimate and
covariance of each AUV, with all fixes delivered by then; where ASVs are; pings under way and
frames on the air.  An event of a happening may be waited for by anybody, and changes nothing.

After the end
-------------
The kernel decides, the record keeps rows, and nothing in here judges them: warnings, verdicts and
words belong to applications that read tables and a `Setup`.

After the last event the AUVs' tracks, estimates and errors are worked out at the rates that
`record` asks for (`trajectories`, `tables`), then metrics: of each AUV how it was served by fixes
and how far off its estimate was (`service`), of the mission and its worst AUV (`metrics`).
Estimates between fixes are formulas, so that a rate changes how often one looks, and not what is
seen.

Invariants
----------
* Noise belongs to a purpose and its vehicles: the same seed gives another mission the same drift.
* What no seed changes, routes, stations, voyages of hulls, is worked out once for all missions of a
  scenario (`launch`).
* A metric is a number, or none where an AUV has nothing that it could be made of; NaN ends the run.
"""
