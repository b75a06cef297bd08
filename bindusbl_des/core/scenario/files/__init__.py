"""Scenarios as YAML files: reading with every mistake at its line, options `--set`, former keys."""
