"""An AUV's estimate of its position: dead reckoning, and navigators that correct it by fixes.

Theory of operation
-------------------
**State.** Navigators do not estimate where an AUV is, but the error of its dead reckoning
(`belief`).  Along x and y of the survey frame (x north, y east) each belief has

    e  the error of dead reckoning (m); the estimated position is dead reckoning minus e
    b  the velocity bias that makes it grow (m/s), in the body's frame or the survey's
    c  the current that no sensor measures (m/s)

and, where a scenario asks for them, a scale and a heading error of the path, a bias that wanders,
and last the errors that fixes have in common (misalignments, GNSS, sound speed, clock, slow
acoustic errors).  `Growth` has the index of each; how many there are is known at run time only.

**Between fixes**

    de/dt = R(yaw) b - c + noise,     P <- F P F^T + Q     (`move`, `grow`)

whose solution over any interval needs only the integral of R(yaw), which vehicles sum up.  So no
filter is stepped, and an AUV's estimate at 17.3 s is one formula.

**A measurement** with the innovation r and the Jacobian H corrects states x and covariance P:

    S = H P H^T + R,   K = P H^T S^-1,   x <- x + K r,   P <- (1 - K H) P (1 - K H)^T + K R K^T

(`fix_update.take` for a fix, a peer's range or bearing; `smoothing.absorb` for single numbers one
after the other).  The paper's navigator is the same with a fixed K (eq. update).  An improbable r^T
S^-1 r (NIS) is refused, but never more than five times in a row: a filter that refuses for ever is
lost.

**A fix depends on the estimate** of the AUV that uses it: its covariance lies across the line of
sight (`turning`), and its systematic part varies with position, J (`fix_update.said_of`).  Both are
taken at the estimated position, which is independent of the noise of this fix; taken at the
measured position they would pull every fix towards its ASV.

**Late fixes.** A fix is pinged at t0 and delivered at t1.  It is valid at t0 (passive: as the ping
arrives), so it is applied there (`correcting`): a navigator stores its last fixes and its belief
before each, inserts the late one, and applies those after it again.  It does so when an estimate is
asked for, in order of delivery; what asks, and when, changes no bit.

**A team** (`team`) has one belief: n AUVs with k states each and one covariance.  The same steps
serve it, on each AUV's states from the index of its first on; a single AUV is a team of one.

**The smoother** (`smoother`) goes back over the mission once it is over, and expands all fixes
again about the smoothed positions.

**Invariants.** A navigator gets fixes as delivered, and its own sensors, of the truth only what the
AUV's pressure sensor has without error: its depth and vertical velocity (`correcting._believed`,
`range_rates`).  What compiled equations need is packed once (`correcting.Known`); all beliefs of a
mission are stored, since past estimates are asked for later.
"""
