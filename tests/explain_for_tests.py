"""Causal chains, as `bindusbl-des explain` tells them."""

from bindusbl_des.apps.explain import chain_of_fix, chain_of_ping

__all__ = ["chain_of_fix", "chain_of_ping"]
