"""The causal chain of one ping or fix, told from the result tables.

Every reason was recorded where it was decided: column `why` says by which rule a signal was not
decoded, `overlapped_by` by what, `call_why` why a call failed, `assignments` who knew which slot.
Here these are put in the order of time, and in words with their numbers.  Nothing is drawn or
searched again.

What is worked out from tracks is how far vehicles were apart, and what a fix changed of an error:
the estimate is known at rows of the track alone, so that is told only where the fix came alone
between two of them.  A folder of an older version, without a reason, is told as one that does not
say.  The parts of a latency add up to it, as they are and as they are printed.
"""

from .chain import Chain, Step
from .ping_and_fix import chain_of_fix, chain_of_ping

__all__ = ["Chain", "Step", "chain_of_fix", "chain_of_ping"]
