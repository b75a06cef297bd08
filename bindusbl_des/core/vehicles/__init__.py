"""Whatever moves: where each vehicle is at any instant, hulls and autopilots, currents, failures.

Theory of operation
-------------------
Frames.  The survey frame {n} is north-east-down: x, y, z in m, z down from the surface, yaw psi in
rad from x towards y.  Body axes {b} are ahead, starboard, down.  Velocities of a hull's state are
over ground in {b}; forces are of nu_r = nu - nu_c, the velocity through the water.

One question.  Everything else asks of a vehicle where it is at an instant t.  The answer is exact
at any t, not at ticks of a clock, because sound meets vehicles at instants of its own.

* A vehicle without dynamics keeps to legs of constant speed, turn rate and climb: closed form.  Its
  path is made of straight lines and arcs (Dubins), and is flown exactly.
* A hull (:mod:`.hulls`) is integrated, six degrees of freedom for AUVs and three for ASVs, by
  M nu_dot + C(nu_r) nu_r + D(nu_r) nu_r + g(eta) = tau, in equal Runge-Kutta steps (0.02 to 0.1 s);
  each boundary is a line of a log, between which position and yaw are cubics.
* Poses from an outside program are such a log as well; beyond the last one they are predicted.

All are lines of one table (`motion.Motion`), which compiled code looks up by vehicle and instant.
Beside the place each line has the integrals of cos(psi) and sin(psi).  With them dead reckoning
(:mod:`.reckoning`) is exact for any interval: a velocity bias b in {b} drifts by the integral of
R(psi) b, whenever it is asked for, without a step in between.

When a vehicle is looked at.  It moves when it is asked for, in whole control intervals of 0.1 s.
At the beginning of each its sensors are read (:mod:`.guidance.sensing`), its place is found on its
path (:mod:`.guidance.tracks`), and its autopilot writes a command that holds for the interval; the
current and biases hold, too.  Nothing is decided in between, so who asks, how often and in which
order, changes no bit.  AUVs follow the tangent of their path by line of sight: the heading aimed at
is that of the path less atan(y_e / lookahead), y_e being the cross-track error; ASVs keep station.
What an autopilot knows is its estimate, never the truth beyond what its instruments tell.

What may be asked of the future.  `fleet.VehicleFleet` says it:

    foreseen     the motion is known to the end: nothing in the mission changes it
    sure_s       it is known so far ahead, since orders are given with a lead
    predicted    an outside program moves it: what lies ahead is only extrapolated
    otherwise    it steers by its own fixes: nothing is known beyond now

`advance(t)` makes the motion known up to t.  Who asks beyond that either waits until the sound is
nearly there, or amends what was predicted.  A line that is known never changes.
"""
