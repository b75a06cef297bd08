"""Inputs that nobody would give on purpose, and what commands make of them.

An input is a kind and a number: ``python -m tests.fuzzing scenario 17`` makes it, shows it whole
and tells how it ends; ``python -m tests.fuzzing scenario 0 500`` goes through five hundred and
prints a line of JSON for each that ends as no input may.
"""
