"""Machine code of kernels that call others."""

import os
import subprocess
import sys

from places import SOURCE

CALLEE = """
from diff_encoder_sim.base.compiled import compiled

@compiled
def times(x):
    return {factor} * x
"""
CALLER = """
from diff_encoder_sim.base.compiled import compiled
from callee import times

@compiled
def total(x):
    return sum([times(one) for one in range(x)])
"""
CALL = 'from caller import total; print(total(3), len(total.stats.cache_hits))'


def called(folder):
    """Return what the caller returns, and whether its machine code was found."""
    environment = {**os.environ, 'PYTHONPATH': f'{SOURCE}:{folder}', 'NUMBA_CACHE_DIR': str(folder / 'kept')}
    return subprocess.check_output([sys.executable, '-c', CALL], env=environment, text=True).split()


def test_a_kernel_is_compiled_again_when_one_that_it_calls_has_changed(tmp_path):
    (tmp_path / 'callee.py').write_text(CALLEE.format(factor=2))
    (tmp_path / 'caller.py').write_text(CALLER)
    assert called(tmp_path) == ['6', '0']
    assert called(tmp_path) == ['6', '1']
    (tmp_path / 'callee.py').write_text(CALLEE.format(factor=30))
    assert called(tmp_path) == ['90', '0']
