"""Sound between vehicles: how it is lost, and when it reaches whom.

Theory of operation
-------------------
A signal leaves a position p at an instant t, lasts T, and travels at c m/s.  It meets a receiver
that moves along q(t) after the delay tau that solves the light-time equation

    |q(t + tau) - p| = c tau                                                   (`travel_time`)

The sender's motion after t changes nothing.  Whether the receiver may decode the signal depends on
both positions at t (`propagation.within`), as the range of a data sheet and the paper's R_HF mean
it: a vehicle that drives out of range meanwhile still hears the signal.  A `long` signal, such as a
frame, ends when the sound that leaves its sender at t + T, from the sender's position by then, has
arrived.

*The channel* answers four questions of a signal, and no others (`propagation.PROSPECT`): how likely
it is lost if nothing overlaps it; its SNR, where the channel knows one; its strength beside sounds
that overlap it; and how much later than on a straight ray it arrives, where rays bend.  The disc of
the paper, with its law of loss (`loss`), is compiled into the propagation itself; every other
channel is asked in numpy, once for all signals that begin at one instant (`channel`,
`named_channels`).

*One table of sounds per band.* Vehicles are numbered AUVs first, then ASVs.  Each signal is on
record as one row for each vehicle that it reaches, in the order in which signals were sent.  A ping
at a vehicle that measures it is a row of `receptions` (`propagation.spread_pings`); calls, frames,
packets, signals of programs, and pings as other AUVs hear them are rows of the band's table of
sounds (`sounds`, written by `signals`).  Both kinds of rows have the columns that one search needs
to find which other sounds arrive at the same time (`sounds.interference`).  While a vehicle sends,
a sound of its own, louder than all others, drowns everything there.

*The outcome* of a signal is decided in this order (`signals.signal_outcome`; for pings that are
measured, `protocol.reception`):

1. out of range: the channel gave it no chance of being decoded when it began;
2. in flight: not over by the instant that is asked about;
3. collided: it is less than `capture` times as strong as noise and all overlapping sounds together
   (`propagation.drowns`); arrivals that only touch do not overlap;
4. lost: by chance, in a burst, by Doppler, or because a vehicle fails meanwhile;
5. heard.

Losses may last (`bursts`): then the luck of a signal is a function of pair and instant alone, so
that neither how often vehicles ping nor what is decided first changes the sea.

What may be asked when
----------------------
A sound's arrival is solved, by the light-time equation, only as far as the motion of both vehicles
is known (`sounds.solve`): to the end where routes are planned, up to now where vehicles steer by
what they hear.  Until then its arrival is infinite, and it overlaps nothing.  So an outcome may be
asked of any sound that is over by now, in any order, and is always the same.

Chance
------
Numbers are drawn for each pair of vehicles from a stream of its own, one row for each signal that
may be decoded, whatever its outcome.  Two scenarios that differ in a schedule, or by one vehicle,
share the noise of all pairs that both have: their difference is not noise.

A new kind of signal needs a reason in `records.events` (the word for it where it overlaps another
signal), a second reason in `signals.ITSELF` (the word where it drowns what its own sender hears), a
call of `Sounds.send` with keys of its own, and a caller that waits for its end.
"""
