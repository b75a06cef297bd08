"""Random access: each vehicle runs a program of its own, and hears what the others send.

Theory of operation
-------------------
A program (`aloha`, `csma`, `t_lohi`, `macau`, `dacap`) is a generator of SimPy's steps: it waits,
listens and sends by the verbs of `node.Node`; it knows nothing but what its vehicle hears.  What it
sends sounds at all others (`air.SharedAir`), on the sea of the HF band (`...acoustics.sounds`):
pings of AUVs become receptions at ASVs as with any schedule, and are sounds at other AUVs; every
other signal is a sound everywhere.

What a vehicle hears is worked out when its program asks.  Carrier (`busy`, `heard`) is whatever
arrives, decoded or not.  A signal is decided once it is over there and a program waits for it: no
event is spent on what nobody waits for.

All that ping at one instant do so together, after everything else of that instant, so that nobody
knows of a signal that begins as it decides.  Meanwhile the downlink goes through its cycles
(`serving.Cycles`): a broadcast as soon as a fix waits and MF is free.
"""

# What a USBL array measures; every other kind of signal is a program's own.
PING = "ping"
