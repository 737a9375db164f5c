"""Wheel encoders: from wheel angles to pulse counts."""
