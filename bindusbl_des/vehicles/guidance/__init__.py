"""How vehicles are steered: AUVs along their paths, ASVs at their stations, in currents and errors.

`GuidedFleet` moves a fleet of one model under its controllers, lazily; `smallest_turn` and
`top_speed` tell what may be asked of one. SI units and radians; x North, y East, z down.
"""
