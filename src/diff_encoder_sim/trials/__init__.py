"""Tests, trials and their outcomes, and the drivers that take a robot through a test."""
