"""What an AUV believes of its position: dead reckoning, and navigators that weigh fixes.

Theory of operation
-------------------
**State.**  Not where an AUV is, but how wrong its dead reckoning is (`belief`).  Along x and y of
the survey frame (x north, y east) each has

    e  the error of dead reckoning (m); the position believed is dead reckoning less e
    b  the velocity bias that makes it grow (m/s), in the body's frame or the survey's
    c  the current that no sensor sees (m/s)

and, where a scenario asks for them, a stretch and a turn of the path, a bias that wanders, and
last the errors that fixes have in common (misalignments, GNSS, sound speed, clock, slow acoustic
errors).  Which state is which is in `Growth`; how many there are is known at run time only.

**Between fixes**

    de/dt = R(yaw) b - c + noise,     P <- F P F^T + Q     (`move`, `grow`)

whose solution over any interval needs the integral of R(yaw) alone, which vehicles sum up.  So no
filter is stepped, and "where does AUV 2 believe to be at 17.3 s?" is one formula.

**A measurement** is off by r from what is believed and goes with the states by slopes H:

    S = H P H^T + R,   K = P H^T S^-1,   x <- x + K r,   P <- (1 - K H) P (1 - K H)^T + K R K^T

(`fix_update.take` for a fix, a peer's range or bearing; `smoothing.absorb` for single numbers one
after the other).  The paper's navigator is the same with a fixed K (eq. update).  If r^T S^-1 r
(NIS) is improbable it is refused, but never more than five times in a row: who refuses for ever is
lost.

**What a fix says** depends on where its reader believes to be: its covariance lies across the line
from the vessel (`turning`), and its systematic part moves with the place, J (`fix_update.said_of`).
Both are taken at the place believed, which has nothing to do with the noise of this fix; taken at
the place measured they would pull every fix towards its vessel.

**Late fixes.**  A fix is pinged at t0 and delivered at t1.  It is valid at t0 (passive: as the ping
arrives), so that it is taken in there (`correcting`): a navigator remembers its last fixes and what
it believed before each, puts the late one in its place and weighs those after it anew.  It takes
effect when somebody asks for an estimate, in order of delivery; who asks, and when, changes no bit.

**A team** (`team`) is believed in together: n AUVs with k states each and one covariance.  The same
steps serve it, each AUV's from the number of its first state on; an AUV by itself is a team of one.

**The smoother** (`smoother`) goes back over the whole mission once it is over, and expands all
fixes anew about what it then believes.

**Invariants.**  Truth is not reachable from here: a navigator gets fixes as delivered, and its own
sensors.  What compiled equations need is packed once (`correcting.Known`); all beliefs that were
ever held are kept, since it is asked later where AUVs took themselves for.
"""
