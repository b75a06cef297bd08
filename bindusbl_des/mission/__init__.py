"""One mission: its world built from a scenario, run by the event kernel, sampled and measured.

Theory of operation
-------------------
`build.build_world` puts together, of the facts of a `Setup` and the streams of a seed: vehicles,
what they carry, the network, and the record.  `mission.Mission` holds the SimPy environment; it can
be advanced to any instant, looked at, and advanced again; `simulation.simulate` does that once, to
the end.  The result is the same, bit for bit.

The kernel decides, the record keeps rows, and nothing in here judges them: warnings, verdicts and
words belong to applications that read tables and a `Setup`.

After the last event the AUVs' tracks, estimates and errors are worked out at the rates that
`record` asks for (`trajectories`), then metrics (`metrics`, `service`).  Estimates between fixes
are formulas, so that a rate changes how often one looks, and not what is seen.
"""
