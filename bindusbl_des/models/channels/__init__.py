"""Channels that ship: the probability that a signal is decoded, and its strength."""
