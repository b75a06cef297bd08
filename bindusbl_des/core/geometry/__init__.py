"""Geometry of the survey: areas, lanes, paths, coverage, land, and positions on Earth.

Theory of operation
-------------------
**Frames.** Survey: x north, y east (m); a heading turns from +x towards +y (rad).  All of this room
is horizontal; depth is a slope along a path, or is added by the caller.  A turned rectangle is
planned in its own frame, whose axes lie along its sides, and its paths are rotated afterwards, so
that a plan does not depend on the survey's heading.

**From an area to a path.** An `Area` (:mod:`.area`) is cut into parallel lanes, which are shared
out among the AUVs (:mod:`.lanes`).  A plan orders the lanes of one AUV and joins their ends by
Dubins curves (:mod:`.routes`); where land cuts lanes, curves must stay on water, and detours follow
a visibility graph (:mod:`.ways`, :mod:`.round_land`).  Routes of a chart become such paths, too
(:mod:`.drawn_routes`).  A `Path` (:mod:`.paths`) is straight lines and circular arcs: position,
heading and bounds follow in closed form from the distance travelled.

**Where ASVs go.** :mod:`.formation` places them on a regular polygon.  :mod:`.coverage` measures
exactly what they hear: within the Voronoi cell of an ASV only its own range circle counts.
:mod:`.covering` looks for better stations (k-centre, maximum coverage); :mod:`.placement` assigns
ASVs to stations at the least motion, and holds the Fisher information of ranges and bearings.

**Land** is polygons in the survey frame (:mod:`.land`).  A straight path that crosses one carries
no sound; a path that only touches a shore does not cross it.

**Earth.** :mod:`.geodesy` holds the plane that touches WGS-84 at the survey's centre, and is the
only place where north-east-down becomes east-north-up.

Everything here is a function of its arguments: nothing is drawn at random, nothing depends on time.
"""
