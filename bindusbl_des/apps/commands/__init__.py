"""The commands of `bindusbl-des`, one module for each group of them.

Modules here import nothing at their top but click and the standard library: `--help` must not wait
for numpy.
"""
