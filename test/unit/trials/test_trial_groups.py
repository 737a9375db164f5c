"""Which trials of a campaign share a drive of the robot."""

import pytest

from campaign_files import small_campaign
from diff_encoder_sim.trials import engine as module
from diff_encoder_sim.trials.engine import trial_groups


def grouped(folder, left_out=(), **changes):
    """The names of the trials of each group."""
    trials = small_campaign(folder, **changes).trials()
    groups = trial_groups([trial for trial in trials if trial.position not in left_out])
    return [' '.join(trial.name for trial in group) for group in groups]


def test_scripted_trials_of_equal_test_and_seed_share_a_drive_and_navigated_ones_do_not(tmp_path, monkeypatch):
    expected = ['SL_40_001 SL_90_001', 'SL_40_002 SL_90_002', 'SMT_40_001 SMT_90_001', 'SMT_40_002 SMT_90_002']
    assert grouped(tmp_path, nav='scripted') == expected
    assert grouped(tmp_path, tests=['SL']) == ['SL_40_001', 'SL_40_002', 'SL_90_001', 'SL_90_002']
    # Of a drive that is partly done, the other trials share it.
    changes = {'nav': 'scripted', 'tests': ['SL'], 'ppr': [40, 90, 1024]}
    assert grouped(tmp_path, (0, 5), **changes) == ['SL_40_002 SL_90_002', 'SL_90_001 SL_1024_001']
    monkeypatch.setattr(module, 'MOST_TOGETHER', 2)
    assert [len(group.split()) for group in grouped(tmp_path, **changes)] == [2, 1, 2, 1]


@pytest.mark.parametrize(
    ('change', 'shared'),
    [
        ({'config.encoder.faults.missed': 0.01}, True),
        ({'config.report.latency': 0.03}, True),
        ({'config.rate': 10.0}, True),
        ({'config.wheel_diameter': 0.21}, True),
        ({'lockstep.odometry': 0.03}, True),
        ({'amcl.kld_err': 0.03}, True),  # no localization
        ({'lockstep.command': 0.03}, False),
        ({'simulator.lidar.noise': 0.02}, False),
        ({'simulator.wheel_errors.slip_noise': 1e-6}, False),
        ({'config.odom_frame': 'odom_of_wheels'}, False),  # in /tf_static
        ({'amcl.global_frame_id': 'world'}, False),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_variants_share_a_drive_if_they_differ_behind_the_wheels(tmp_path, change, shared):
    changes = {'nav': 'scripted', 'tests': ['SL'], 'ppr': [40], 'trials': 1, 'variants': {'one': {}, 'two': change}}
    assert [group.count('SL_40') for group in grouped(tmp_path, **changes)] == ([2] if shared else [1, 1])
