"""Vehicles: where each is at any instant; hulls and autopilots, currents, failures.

Theory of operation
-------------------
Frames.  The survey frame {n} is north-east-down: x, y, z in m, z down from the surface, yaw psi in
rad from x towards y.  Body axes {b} are ahead, starboard, down.  Velocities of a hull's state are
over ground in {b}; forces are of nu_r = nu - nu_c, the velocity through the water.

One question.  The rest of the simulator asks of a vehicle where it is at an instant t.  The answer
is exact at any t, not at ticks of a clock, because sound meets vehicles between ticks.

* A vehicle without dynamics keeps to legs of constant speed, turn rate and climb: closed form.  Its
  path is made of straight lines and arcs (Dubins), and is flown exactly.
* A hull (:mod:`.hulls`) is integrated, six degrees of freedom for AUVs and three for ASVs, by
  M nu_dot + C(nu_r) nu_r + D(nu_r) nu_r + g(eta) = tau, in equal Runge-Kutta steps (0.02 to 0.1 s);
  each boundary is a line of a log, between which position and yaw are cubics.
* Poses from an outside program are such a log as well; beyond the last one they are predicted.

All are lines of one table (`motion.Motion`), which compiled code looks up by vehicle and instant.
Beside the position each line has the integrals of cos(psi) and sin(psi).  With them dead reckoning
(:mod:`.reckoning`) is exact for any interval: a velocity bias b in {b} drifts by the integral of
R(psi) b, whenever it is asked for, without a step in between.

Control intervals.  A fleet with dynamics moves when its position is asked for, in whole control
intervals of 0.1 s.  As each begins, sensors are read (:mod:`.guidance.sensing`), the vehicle is
located on its path (:mod:`.guidance.tracks`), and its autopilot writes a command that holds for the
interval; the current and biases hold, too.  Nothing is decided in between, so the order and number
of questions change no bit.  AUVs follow the tangent of their path by line of sight: the desired
heading is that of the path less atan(y_e / lookahead), y_e being the cross-track error; ASVs keep
station.  An autopilot knows its estimate, and of the truth only what its instruments measure.

How far ahead a motion is known.  `fleet.VehicleFleet` has:

    foreseen     the motion is known to the end: nothing in the mission changes it
    sure_s       the motion is known this far ahead (s), since orders are given with a lead
    predicted    an outside program moves the vehicles: what lies ahead is only extrapolated
    otherwise    the vehicles steer by their own fixes: nothing is known beyond now

`advance(t)` makes the motion known up to t.  Code that needs a later instant either waits until the
sound is nearly there, or amends what was predicted.  A line that is known never changes.
"""
