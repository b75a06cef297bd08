"""What an AUV believes of its position: dead reckoning, and navigators that weigh fixes.

Theory of operation
-------------------
The state is not where an AUV is, but how wrong its dead reckoning is (`belief`): the error e, the
velocity bias b that makes it grow, the current c that no sensor sees, and what else a scenario asks
for.  Between fixes

    de/dt = R(yaw) b - c + noise

whose solution over any interval needs the integral of R(yaw) alone, which vehicles sum up.  So no
filter is stepped between fixes, and "where does AUV 2 believe to be at 17.3 s?" is one formula.

A fix is late: pinged at t0, delivered at t1.  It is a measurement of t0, so that it is taken in
there (`correcting`): a navigator remembers its last fixes and what it believed before each, puts
the late one in its place and weighs those after it anew.  The paper's navigator, a fixed gain
(eq. update), does what eq. update says at t1.

What a fix says depends on where its reader believes to be: its covariance lies across the line from
the vessel (`turning`), and its systematic part moves with the place (J).  Both are taken at the
place believed, which has nothing to do with the noise of this fix; taken at the place measured
they would pull every fix towards its vessel.

A fix whose normalised innovation squared is improbable is refused (`fix_update`), but never more
than five in a row: who refuses for ever is lost.

The smoother (`smoother`) goes back over the whole mission once it is over, and expands all fixes
anew about what it then believes.

Truth is not reachable from here: a navigator gets fixes as delivered, and its own sensors.
"""
