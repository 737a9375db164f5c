"""Estimates against the truth: trajectories, samples of errors, maps."""
