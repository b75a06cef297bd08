"""Scenarios as YAML files: read with every mistake at its place, overridden, begun anew."""
