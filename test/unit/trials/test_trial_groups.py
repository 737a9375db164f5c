"""Which trials of a campaign share a drive of the robot."""

import pytest

from campaign_files import small_campaign
from diff_encoder_sim.trials import engine as module
from diff_encoder_sim.trials.engine import trial_groups


def grouped(folder, jobs=None, **changes):
    """The names of the bags of each group."""
    campaign = small_campaign(folder, **changes)
    groups = trial_groups(campaign.trials() if jobs is None else jobs)
    return [' '.join(job.name for job in group) for group in groups]


def test_scripted_trials_of_equal_test_and_seed_share_a_drive(tmp_path):
    assert grouped(tmp_path, nav='scripted') == [
        'SL_40_001 SL_90_001',
        'SL_40_002 SL_90_002',
        'SMT_40_001 SMT_90_001',
        'SMT_40_002 SMT_90_002',
    ]


def test_navigated_trials_share_none(tmp_path):
    assert grouped(tmp_path, tests=['SL']) == ['SL_40_001', 'SL_40_002', 'SL_90_001', 'SL_90_002']


def test_of_trials_that_are_done_in_part_the_others_share_a_drive(tmp_path):
    jobs = small_campaign(tmp_path, nav='scripted', tests=['SL'], ppr=[40, 90, 1024]).trials()
    left = [job for job in jobs if job.position not in (0, 5)]
    assert grouped(tmp_path, left, nav='scripted', tests=['SL'], ppr=[40, 90, 1024]) == [
        'SL_40_002 SL_90_002',
        'SL_90_001 SL_1024_001',
    ]


@pytest.mark.parametrize(
    ('change', 'shared'),
    [
        ({'config.encoder.faults.missed': 0.01}, True),
        ({'config.report.latency': 0.03}, True),
        ({'config.rate': 10.0}, True),
        ({'config.wheel_diameter': 0.21}, True),
        ({'lockstep.odometry': 0.03}, True),
        ({'amcl.kld_err': 0.03}, True),  # nobody localizes
        ({'lockstep.command': 0.03}, False),
        ({'simulator.lidar.noise': 0.02}, False),
        ({'simulator.wheel_errors.slip_noise': 1e-6}, False),
        ({'config.odom_frame': 'odom_of_wheels'}, False),  # in /tf_static
        ({'amcl.global_frame_id': 'world'}, False),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_variants_share_a_drive_where_they_differ_behind_the_wheels(tmp_path, change, shared):
    made = {'nav': 'scripted', 'tests': ['SL'], 'ppr': [40], 'trials': 1}
    groups = grouped(tmp_path, **made, variants={'one': {}, 'two': change})
    assert [group.count('SL_40') for group in groups] == ([2] if shared else [1, 1])


def test_a_group_has_a_largest_size(tmp_path, monkeypatch):
    monkeypatch.setattr(module, 'MOST_TOGETHER', 3)
    groups = grouped(tmp_path, nav='scripted', tests=['SL'], trials=1, ppr=[10, 20, 30, 40, 50, 60, 70])
    assert [len(group.split()) for group in groups] == [3, 3, 1]
