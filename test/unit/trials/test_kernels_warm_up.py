"""Compiling ahead of trials."""

from warm_kernels import check_nothing_is_left_to_compile

WARM_UP = """
from diff_encoder_sim.trials.kernels_warm_up import PARTS
from lockstep_trials import BEND, ended, lockstep
for part in PARTS: part()
"""


def test_nothing_is_left_to_compile_in_a_trial():
    check_nothing_is_left_to_compile('localization navigation simulation', WARM_UP, 'ended(lockstep(BEND))')
