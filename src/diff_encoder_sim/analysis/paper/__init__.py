"""Comparison with the source paper: its cells, claims and errata."""
