"""The causal chain of one ping or fix, explained from the result tables.

The mission records each reason where it decides: column `why` names the rule by which a signal was
not decoded, `overlapped_by` the interfering signal, `call_why` why a call failed, `assignments`
which AUV knew which slot.  This room sorts the records by time and words them with their numbers;
it draws and decides nothing again.

Two things are computed from tracks: distances between vehicles, and the error of an estimate before
and after a fix, which is given only if no other fix came between the same two rows.  If a folder of
an older version lacks a reason, the text says so.  The parts of a latency add up to it, also as
printed.
"""

from .chain import Chain, Step
from .ping_and_fix import chain_of_fix, chain_of_ping

__all__ = ["Chain", "Step", "chain_of_fix", "chain_of_ping"]
