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

*Words.*  A **round** gives every AUV its turn; its **slots** are the turns of ping groups.  A
**signal** is anything that sounds: ping, call, frame, data packet, a program's signal.  A
**reception** is a ping where somebody listens.  A **fix** is what is measured of a ping: place and
covariance.  A **frame** carries fixes on MF.  A **delivery** is the instant from which an AUV has a
fix.  All durations are those of `slots.Slots`, counted in the crossing time t_C of the survey:

    t_C = L / c         guard T_G = 0.5 t_C       T_UL = max(T_P + R_HF / c + T_G, 2.5 t_C)
    T_tx airtime        guard T_DL,G = 1.25 t_C   T_DL = max(T_tx + T_DL,G, 10 t_C)

All instants are exact, or those of a clock with ticks: computed from a start and a duration, and
never read from `env.now`, in which roundings add up.

A ping on HF
------------
1. `pings.HfBand.send` writes a row of `pings` and, for everybody who listens, a row of
   `receptions`: in range or not, when the front arrives, how likely it is lost, how strong a sound
   it is.  A listener that steers meanwhile has no sure future: its arrival is worked out when the
   ping is nearly there; one that an outside program moves was predicted, and is amended.
2. `outcomes.Outcomes.resolve_passed(t)` decides what has passed by t, in the order in which it did
   (`reception.resolve`, compiled).  In this order: a vessel that sends meanwhile is deaf; sounds
   that overlap destroy each other; else it is lost by chance or in a burst; else it is heard.
3. Of a ping that anybody has heard a fix is made, by all vessels, once it has passed them all.

With passive ranging the two fleets have changed places: `BeaconBand` sends, `OwnOutcomes` decides
each reception by itself, as soon as it is over, and the AUV that has heard it fixes itself.

Fixes on MF
-----------
`frames.MfDownlink.send` notes a frame, and tells each of its fixes when it will arrive.  What
becomes of the frame at an AUV is worked out when somebody asks: it is cut where the vessel failed;
lost by the channel; destroyed by a frame that overlaps it, or by the AUV's own ping where it has
one transducer (`duplex: per_node`); else heard.  `exchange.Exchange` is that band where AUVs send,
too: there nothing is known before it has happened.

What is decided late, and why
-----------------------------
Only what somebody waits for is an event: starts of slots, calls and answers, frames, replies, and
deliveries to AUVs that steer by them (`happenings` for whoever looks).  What becomes of a ping, a
frame or a fix is decided when somebody wants to know, and not before all sound that could overlap
it is on record.  It does not matter how much later, since every number that decides is a function
of the pair of vehicles and of how many signals it has had.  That is why a sweep that asks for
nothing but final errors gets the same numbers as a notebook that looks at every instant, many
times faster.

What may be asked when
----------------------
At any instant: what becomes of a reception that is over by then (`outcome_of`), although it is not
decided yet: it is foretold with the numbers that will decide it.  Which AUVs have decoded a frame
by now (`decoded`).  Not: anything of an instant that is to come.

Invariants
----------
* Rows are written in the order of sending, so that a search for overlaps ends at the first signal
  that was over before, or sent after.
* A reception is in flight until it is decided, once; each takes one row of its pair's noise,
  whatever becomes of it.
* Fixes are delivered in the order of their arrival, each with its own instant, however late that is
  worked out.
* Who knows what is kept apart.  The fleet goes by `predicted_positions` and by what its own
  messages told; with `knowledge: broadcast` an AUV knows its slots by frames that it has decoded
  (`dissemination`).  The truth decides what sound does, and nothing else.
"""
