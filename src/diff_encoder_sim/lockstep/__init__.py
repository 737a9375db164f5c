"""A whole trial in one process, on simulated time."""
