"""From recordings to errors and tables."""
