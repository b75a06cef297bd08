"""The HF band: pings, and calls for them, at whoever listens.

Theory of operation
-------------------
1. `band.HfBand.send` writes a row of `pings` and, for everybody who listens, a row of `receptions`:
   in range or not, when the front arrives, how likely it is lost, how strong a sound it is.  AUVs
   send and ASVs listen; with passive ranging the two fleets have changed places.  A listener that
   steers meanwhile has no sure future: its arrival is worked out when the ping is nearly there; one
   that an outside program moves was predicted, and is amended.
2. `outcomes.Outcomes.resolve_passed(t)` decides what has passed by t, in the order in which it did
   (`reception.resolve`, compiled).  In this order: a vessel that sends meanwhile is deaf; sounds
   that overlap destroy each other; else it is lost by chance or in a burst; else it is heard.
3. Of a ping that anybody has heard a fix is made: one of all vessels, once the ping has passed them
   all; or, where AUVs listen, one for each, as soon as it is over there.

What may be asked at any time: what becomes of a reception that is over (`outcome_of`), although it
is not decided yet.  It is foretold with the numbers that will decide it.

Invariants: rows are written in the order of sending, so that a search for overlaps ends at the
first ping that was over before, or sent after.  A reception is in flight until it is decided, once.
Each takes one row of its pair's noise, whatever becomes of it.
"""
