"""The causal chain of one ping or fix, told from the result tables."""

from .chain import Chain, Step
from .ping_and_fix import chain_of_fix, chain_of_ping

__all__ = ["Chain", "Step", "chain_of_fix", "chain_of_ping"]
