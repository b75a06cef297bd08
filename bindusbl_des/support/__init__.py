"""Shared tools: compiled equations, clocks, random streams, durable files, wording."""
