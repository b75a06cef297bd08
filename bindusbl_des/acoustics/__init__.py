"""Sound between vehicles: what is lost on the way, and when it reaches whom.

Theory of operation
-------------------
A signal leaves a place p at an instant t, lasts T, and spreads at c m/s.  It meets a receiver that
moves along q(t) after the delay tau that solves the light-time equation

    |q(t + tau) - p| = c tau                                                   (`travel_time`)

How the sender moves after t changes nothing.  Whether the signal may be decoded there is settled
by where both are at t (`propagation.within`), since that is what the range of a data sheet and of
the paper's R_HF means: a vehicle that drives out of range meanwhile still hears it.

A channel answers four questions of a signal, and no others (`propagation.PROSPECT`): how likely it
is lost if nothing overlaps it; its SNR, where it knows of one; how strong a sound it is where it
overlaps others; and how much later than straight on it comes, where rays bend.  The disc of the
paper, with its law of loss (`loss`), is compiled into the spreading itself; every other channel is
asked in numpy, once for all signals that begin at one instant.

Two signals that overlap at a receiver by more than rounding destroy each other, unless one is
`capture` times as strong as noise and all others together (`propagation.drowns`).  Losses may last
(`bursts`): then luck is a function of pair and instant alone, so that neither how often somebody
pings nor what is decided first changes the sea.

All vehicles share one sea, whoever sends and whoever listens (`sounds`): a ping at an ASV, a call
or another AUV's signal at an AUV, a frame there are rows of one kind, in the order in which they
were sent, and one search finds what else is there as one of them arrives.  A vehicle that sends is
deaf by a sound of its own, louder than all others.

Numbers are drawn for each pair of vehicles from a stream of its own, one row for each signal that
may be decoded, whatever becomes of it.  Two scenarios that differ in a schedule, or in a vehicle
more, share the noise of all pairs that both have: their difference is not noise.
"""
