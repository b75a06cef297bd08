"""Channels: who hears a signal, and with what chance or loss."""
