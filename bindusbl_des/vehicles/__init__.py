"""Whatever moves: its way at any instant, hulls and their guidance, currents, recorded tracks.

Theory of operation
-------------------
Everybody else asks one question of a vehicle: where is it at the instant t?  The answer is exact
at any t, not at steps of a clock, because sound meets vehicles at instants of its own.

* A kinematic vehicle keeps to legs of constant speed, turn rate and climb: closed form.
* A hull (Fossen, 6 DOF for AUVs, 3 DOF for ASVs) is integrated with Runge-Kutta at equal steps, and
  its log is interpolated.
* A recorded or an outside pose is interpolated as well.

All three are lines of one table (`motion.Motion`), which compiled code looks up.  What a mission
may ask of the future differs, and `fleet.VehicleFleet` says it:

    foreseen     the motion is known to the end: nothing in the mission changes it
    sure_s       it is known so far ahead, since it is steered with a lead
    predicted    an outside program moves it: what lies ahead is only extrapolated
    otherwise    it steers by its own fixes: nothing is known beyond now

`advance(t)` makes the motion known up to t.  Who asks beyond what is known either waits until the
sound is nearly there, or amends what it had predicted.

Beside the place each line sums up the integrals of cos(yaw) and sin(yaw).  With them dead reckoning
(`reckoning`) is exact for any interval: a velocity bias b in the body drifts by the integral of
R(yaw) b, whenever somebody asks, without a step in between.
"""
