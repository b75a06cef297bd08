"""What an ASV measures of a ping, and the fix that ASVs make of it together.

Theory of operation
-------------------
**Frames.** Survey: x north, y east, z down (m); an array's: x forward, y to starboard, z down.
Azimuth runs from x towards y, elevation is positive downwards (rad).

**One measurement** (`sights.sighting`, `measuring`) has three parts, each with its own noise:

    range      r = c_a (tau + n_t), tau the travel time by synchronised clocks
    direction  s: that of the plane wave which best fits the differences of arrival times at the
               elements of the array (`array`), or the angles that a data sheet states
    attitude   R = R(roll, pitch, heading) by the AHRS, so that the source is at the offset r R s

and puts the source at the ASV's own GNSS position plus r R s, slightly shortened, since a direction
with an angular error puts it too far away on average (`measuring.debias`).  The covariance is that
of the three parts at the measured position (eq. usbl_fix).

**Its error** has three parts (white, slow, systematic), each zero where an instrument has none:

    z = p + J(p) c + B c^2 / 2 + noise

The white part is drawn for each reception, from a row of standard normal numbers of its pair of
vehicles. c outlasts the ping: heading misalignments, slow GNSS errors, a wrong sound speed, a late
clock, and the slow share of acoustic errors (`slow_errors`).  J and B are the derivatives of the
fix by c (`systematic_effects`).  A navigator that has c as states uses J; any other gets a
covariance that contains c.

**Geometry** is all that differs between the kinds of ranging:

    one way    the range is the path
    two ways   the path is that of a call and its answer: an ellipse; the caller takes half of it,
               and tells all others when the AUV answered (`two_way`, eq. rtt)
    passive    array, AHRS and clock are the AUV's, the source is the ASV: the mirror image
               (`fixes.located_itself`)

**Fusion.** ASVs that heard the same ping fuse their measurements, once its outcome is known at
every ASV (`fixes`, `fusion`): minimum variance, linear, unbiased.  Errors that they have in common
(sound speed, the AUV's clock, the call's path) are unknowns there, or they would be averaged as if
independent.

**When.** A fix is valid at the instant of its ping, for an answer at the answer's, with passive
ranging as the ping arrives.  It is made when it is asked for; noise is drawn by pair and count, so
that this changes no bit.  What navigators need to expand a fix about their own beliefs is written
to each reception (`sights.note_sight`).  What every ping is measured with is packed once
(`measuring.PackedInstrument`, `systematic_effects.PackedErrors`).  No instrument gets the truth
that it measures.
"""
