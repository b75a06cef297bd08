"""Figures of results: drawn from their tables, in one style, for screens and papers."""
