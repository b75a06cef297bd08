"""Sound between vehicles: what is lost on the way, and when it reaches whom.

Theory of operation
-------------------
A signal leaves a place p at an instant t, lasts T, and spreads at c m/s.  It meets a receiver that
moves along q(t) after the delay tau that solves the light-time equation

    |q(t + tau) - p| = c tau                                                   (`travel_time`)

How the sender moves after t changes nothing.  Whether the signal may be decoded there is settled
by where both are at t (`propagation.within`), since that is what the range of a data sheet and of
the paper's R_HF means: a vehicle that drives out of range meanwhile still hears it.  A signal that
is `long`, such as a frame, ends when what leaves at t + T, from where its sender is by then, has
come.

*The channel* answers four questions of a signal, and no others (`propagation.PROSPECT`): how likely
it is lost if nothing overlaps it; its SNR, where it knows of one; how strong a sound it is where it
overlaps others; and how much later than straight on it comes, where rays bend.  The disc of the
paper, with its law of loss (`loss`), is compiled into the spreading itself; every other channel is
asked in numpy, once for all signals that begin at one instant (`channel`, `named_channels`).

*One sea.*  Vehicles are numbered AUVs first, then ASVs.  Whatever sounds, whoever sends it, is on
record as a row for each vehicle that it reaches, in the order in which signals were sent: pings at
those who measure them as receptions (`propagation.spread`), everything else as sounds (`sounds`):
calls, frames, data packets, signals of programs, pings as other AUVs hear them (`signals`).  Both
kinds of rows have the columns that one search needs to find what else is there as one of them
arrives (`sounds.interference`).  A vehicle that sends is deaf by a sound of its own, louder than
all others.

*What becomes of it* is decided in this order (`signals.signal_outcome`; pings, of which
measurements are made, in `protocol.reception`):

1. out of range: no prospect of decoding it where it began;
2. in flight: not over by the instant that is asked about;
3. collided: the sounds that overlap it are so strong together that it is not `capture` times as
   strong as noise and all of them (`propagation.drowns`); arrivals that only touch do not overlap;
4. lost: by chance, in a burst, by Doppler, or since a vehicle fails meanwhile;
5. heard.

Losses may last (`bursts`): then luck is a function of pair and instant alone, so that neither how
often vehicles ping nor what is decided first changes the sea.

What may be asked when
----------------------
A sound is solved, by the light-time equation, only as far as it is known how both vehicles move
(`sounds.solve`): to the end where routes are planned, up to now where they steer by what they
hear.  Until then its arrival is infinite, and it overlaps nothing.  So an outcome may be asked of
any sound that is over by now, in any order, and is always the same.

Chance
------
Numbers are drawn for each pair of vehicles from a stream of its own, one row for each signal that
may be decoded, whatever becomes of it.  Two scenarios that differ in a schedule, or in a vehicle
more, share the noise of all pairs that both have: their difference is not noise.

A further kind of signal needs a reason in `records.events` (what it is called where it overlaps
another), a call of `Sounds.send` with keys of its own, and whoever waits for its end.
"""
