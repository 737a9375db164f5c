"""The confidence of all intervals that are shown."""

from __future__ import annotations

LEVEL = 0.95
