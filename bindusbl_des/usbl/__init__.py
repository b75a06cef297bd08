"""What a surface vessel measures of a ping, and the fix that the vessels make of it together.

Theory of operation
-------------------
One measurement has three parts (`measuring`), each with its own noise:

    range      r = c_a (tau + n_t), by synchronised clocks, or half of a call's and its answer's way
    direction  s: that of the plane wave which best fits the differences of arrival times at the
               elements of the array (`array`), or the angles that a data sheet states
    attitude   R = R(roll, pitch, heading) by the AHRS, so that the source lies at r R s

The fix is the vessel's own place by its GNSS plus r R s, made a little shorter, since a direction
that errs by an angle places a source too far out on average (`covariance.debias`).  Its covariance
is that of the three parts at the place measured.  It is never told the truth.

Errors that outlast a ping are no noise: a heading misalignment, a slow GNSS error, a sound speed
taken for another, a clock that is late, the slow part of acoustic errors.  The fix is

    z = p + J(p) c + noise

with c these errors and J how the fix moves with each (`systematic_effects`).  A navigator that has
them as states takes J; one that has not gets a covariance that contains them.

Vessels that heard the same ping fuse what they measured (`fusion`): minimum variance, linear,
unbiased.  What they have in common (sound speed, the AUV's clock, the way of a call) is one more
unknown there, or it would be averaged as if each had an error of its own.

With passive ranging the array and the AHRS are the AUV's and the source is the vessel: everything
is the mirror image (`inverted`).
"""
