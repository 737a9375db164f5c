"""Tests, trials and their outcomes, and who drives a robot through a test."""
