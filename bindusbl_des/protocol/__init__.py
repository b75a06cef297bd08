"""Who sounds when: slots, schedules, both bands, and the rounds that the fleet runs through.

Theory of operation
-------------------
A mission runs on a SimPy environment.  One process, `tdma.serve`, goes through the rounds as the
paper's timeline reads (`passive.take_turns` where ASVs ping):

    fleet's predicted positions -> conflict graph -> colours -> one slot T_UL for each colour
    in a slot its AUVs ping (`ranging`: by their clocks, or called)
    then T_DL: the fixes that wait go into frames, sent by the ASVs that a broadcaster chooses

With random access each vehicle runs a program of its own, beside the cycles of the downlink
(`access`).

Only what somebody waits for is an event: starts of slots, calls and answers, frames, replies, and
deliveries to AUVs that steer by them.  All instants are exact, or those of a clock with ticks.

What becomes of a ping, a frame or a fix is *decided late*: when somebody wants to know, and not
before all sound that could overlap it is on record.  It does not matter how much later, since every
number that decides is a function of the pair of vehicles and of how many signals it has had.  That
is why a sweep that asks for nothing but final errors gets the same numbers as a notebook that looks
at every instant (`happenings`), many times faster.

Who knows what is kept apart.  The fleet goes by `predicted_positions` and by what its own messages
told; with `knowledge: broadcast` an AUV knows its slots by frames that it has decoded
(`dissemination`).  The truth decides what sound does, and nothing else.
"""
