"""What a surface vessel measures of a ping, and the fix that the vessels make of it together.

Theory of operation
-------------------
**Frames.**  Survey: x north, y east, z down (m); an array's: x forward, y to starboard, z down.
Azimuth runs from x towards y, elevation is positive downwards (rad).

**One measurement** (`two_way.measure`, `measuring`) has three parts, each with its own noise:

    range      r = c_a (tau + n_t), tau the travel time by synchronised clocks
    direction  s: that of the plane wave which best fits the differences of arrival times at the
               elements of the array (`array`), or the angles that a data sheet states
    attitude   R = R(roll, pitch, heading) by the AHRS, so that the source lies at r R s

and places the source at the vessel's own place by its GNSS plus r R s, made a little shorter, since
a direction that errs by an angle places it too far out on average (`measuring.debias`).  Its
covariance is that of the three parts at the place measured (eq. usbl_fix).

**Its error** is a vector (white, slow, systematic), zero where an instrument has none:

    z = p + J(p) c + B c^2 / 2 + noise

The white part is drawn for each reception, from a row of standard normal numbers of its pair of
vehicles.  c outlasts the ping: heading misalignments, slow GNSS errors, a sound speed taken for
another, a late clock, and the share of acoustic errors that changes slowly (`slow_errors`).  J and
B say how the fix moves with each (`systematic_effects`).  A navigator that has c as states takes J;
one that has not gets a covariance that contains c.

**Geometry** is all that differs between the kinds of ranging:

    one way    the range is the path
    two ways   the path is that of a call and its answer: an ellipse; the caller takes half of it,
               and tells all others when the AUV answered (`two_way`, eq. rtt)
    passive    array, AHRS and clock are the AUV's, the source is the vessel: the mirror image
               (`fixes.located_itself`)

**Fusion.**  Vessels that heard the same ping fuse what they measured, once its fate is known at
every one of them (`fixes`, `fusion`): minimum variance, linear, unbiased.  What they have in common
(sound speed, the AUV's clock, the way of a call) is one more unknown there, or it would be averaged
as if each had an error of its own.

**When.**  A fix is valid at the instant of its ping, of an answer at that of the answer, of passive
ranging as the ping arrives.  It is made as late as somebody asks; noise is drawn by pair and count,
so that this changes no bit.  What navigators expand anew about their own beliefs is noted with each
reception (`sights`).  What every ping is measured with is packed once
(`measuring.PackedInstrument`, `systematic_effects.PackedErrors`).  No instrument is told the truth
that it measures.
"""
