"""Conformance suite: is an odometry node right? Judges any node by its messages."""
