"""Campaigns: the same tests over encoders and parameters, many trials each, into one folder."""
