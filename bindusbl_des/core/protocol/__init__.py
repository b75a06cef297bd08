"""Who sounds when: slots, schedules, both bands, and the rounds that the fleet runs through.

Theory of operation
-------------------
A mission runs on a SimPy environment.  One process, `tdma.serve`, goes through the rounds as the
paper's timeline reads (`tdma.take_turns` where ASVs ping):

    fleet's predicted positions -> conflict graph -> colours -> one slot T_UL for each colour
    in a slot its AUVs ping (`ranging`: by their clocks, or called)
    then T_DL: the fixes that wait go into frames, sent by the ASVs that a broadcaster chooses

With random access each vehicle runs a program of its own, beside the cycles of the downlink
(`access`).

*Words.* A **round** gives every AUV its turn; each of its **slots** is the turn of one ping group.
A **signal** is anything that sounds: ping, call, frame, data packet, a program's signal.  A
**reception** is one ping at one listener.  A **fix** is the position and covariance measured by a
ping.  A **frame** carries fixes on MF. A **delivery** is the instant from which an AUV has a fix.
All durations are those of `slots.Slots`, counted in the crossing time t_C of the survey:

    t_C = L / c         guard T_G = 0.5 t_C       T_UL = max(T_P + R_HF / c + T_G, 2.5 t_C)
    T_tx airtime        guard T_DL,G = 1.25 t_C   T_DL = max(T_tx + T_DL,G, 10 t_C)

Each instant is computed from a start and a duration, exactly or on a clock with ticks, and never
read from `env.now`, in which rounding errors add up.

A ping on HF
------------
1. `pings.HfBand.send` writes a row of `pings` and, for each listener, a row of `receptions`: in
   range or not, when the front arrives, how likely it is lost, how strong it is.  Where a listener
   steers meanwhile, its arrival is worked out when the ping is nearly there; where an outside
   program moves it, the arrival is predicted, and amended later.
2. `outcomes.Outcomes.resolve_passed(t)` decides all pings that have passed by t, in the order in
   which they did (`reception.resolve`, compiled).  It asks in this order: does the listener send
   meanwhile, so that it hears nothing; do other sounds drown the ping; is it lost by chance or in a
   burst; else it is heard.
3. Once a ping has passed all ASVs, those that heard it make one fix.

A call is decided as it is sent: only sounds on record by then can drown it at its AUV.

With passive ranging the two fleets have changed places: ASVs ping on the `BeaconBand`,
`OwnOutcomes` decides each reception by itself as soon as it is over, and the AUV that has heard the
ping fixes itself.

Fixes on MF
-----------
`frames.MfDownlink.send` notes a frame, and writes to each of its fixes when it will arrive.  A
frame's outcome at an AUV is worked out when it is asked for: cut, where the ASV failed as it sent;
lost by the channel; destroyed by a frame that overlaps it, or by the AUV's own ping where the AUV
has one transducer (`duplex: per_node`); else heard.  `exchange.Exchange` is that band where AUVs
send, too: there each frame is decided as it ends at a listener.

Where AUVs follow planned routes, their estimates steer nothing: a fix is applied when the mission
asks for the estimate (`Deliveries.settle`), at the latest at its end, but with its own instant.
AUVs that steer by their estimates have each fix at the event of its delivery.

AUVs may range each other as well (`peers`), by programs beside all this on HF.

What is decided late, and why
-----------------------------
Only what something waits for is an event: starts of slots, calls and answers, frames, replies, and
deliveries to AUVs that steer by them (`happenings` for a user's code).  A ping, a frame or a fix is
decided when its outcome is asked for, and not before all sound that could overlap it is on record.
How much later does not matter: every number that decides is a function of the pair of vehicles and
of how many signals that pair has had.  So a sweep that asks for final errors alone gets the same
numbers as a notebook that looks at every instant, many times faster.

What may be asked when
----------------------
At any instant: the outcome of a reception that is over by then (`outcome_of`), although it is not
decided yet; it is worked out with the numbers that will decide it.  Which AUVs have decoded a frame
by now (`decoded`).  Not: anything of a later instant.

Invariants
----------
* Rows are written in the order of sending, so that a search for overlaps ends at the first signal
  that was over before, or sent after.
* A reception is in flight until it is decided, once; each takes one row of its pair's noise,
  whatever its outcome.
* Fixes are delivered in the order of their arrival, each with its own instant, however late that is
  worked out.
* Truth and knowledge are kept apart.  The fleet goes by `predicted_positions` and by the messages
  that it has decoded; with `knowledge: broadcast` an AUV knows its slots by frames that it has
  decoded (`dissemination`).  Only the sound itself depends on the truth.
"""
