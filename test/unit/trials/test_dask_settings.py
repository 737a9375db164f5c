"""Dask's log stays silent in a process that has not imported Dask yet."""

import subprocess
import sys

from places import SOURCE

PRINT_LEVELS = """
import logging, sys
from diff_encoder_sim.trials.dask_settings import silence_dask
assert 'distributed' not in sys.modules
silence_dask()
import distributed
print(*(logging.getLevelName(logging.getLogger(name).level) for name in ('distributed', 'distributed.client')))
"""


def test_dask_is_silent_though_it_is_imported_late():
    done = subprocess.run(
        [sys.executable, '-c', PRINT_LEVELS], env={'PYTHONPATH': str(SOURCE)}, stdout=subprocess.PIPE, text=True
    )
    assert done.stdout == 'CRITICAL CRITICAL\n'
