"""Counts on a benchmark's command line: none of nothing, which would end in a median of nothing."""

from __future__ import annotations

import checkout  # noqa: F401 (finds the package)

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.command_line import whole_number_within

MOST = 1_000_000
COUNT = whole_number_within(Between(1, MOST))
