"""Random access: each vehicle runs an access program of its own, and hears what the others send.

Theory of operation
-------------------
A program (`aloha`, `csma`, `t_lohi`, `macau`, `dacap`) is a generator of SimPy's steps: it waits,
listens and sends by the verbs of `node.Node`; it knows nothing but what its vehicle hears.  What it
sends sounds at all other vehicles (`air.SharedAir`), on the sea of the HF band
(`...acoustics.sounds`): pings of AUVs become receptions at ASVs as with any schedule, and are
sounds at other AUVs; every other signal is a sound everywhere.

What a vehicle hears is worked out when its program asks.  Carrier (`busy`, `heard`) is every sound
that arrives, decoded or not.  A signal is decided once it is over at a vehicle whose program waits
for it: no event is spent on others.

AUVs that ping at one instant do so together, after everything else of that instant, so that no
program knows of a signal that begins as it decides.  Meanwhile the downlink runs its cycles
(`serving.Cycles`): a broadcast as soon as a fix waits and MF is free.
"""

# The kind of signal that a USBL array measures; a program names all others.
PING = "ping"
