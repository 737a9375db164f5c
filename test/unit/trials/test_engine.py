"""Which trials share a drive, and where trials run; whole campaigns, with kills, are in test/test_campaign.py."""

import os
import sys
import time
from concurrent.futures.process import BrokenProcessPool

import pytest
from distributed.versions import get_versions

from campaign_files import small_campaign
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials import engine as module
from diff_encoder_sim.trials.engine import trial_groups
from diff_encoder_sim.trials.executors import ENVIRONMENT, PACKAGES, check_versions, connected_workers, local_workers


def grouped(folder, **changes):
    """The names of the trials of each group."""
    groups = trial_groups(small_campaign(folder, **changes).trials())
    return [' '.join(trial.name for trial in group) for group in groups]


def test_scripted_trials_of_equal_test_and_seed_share_a_drive_and_navigated_ones_do_not(tmp_path, monkeypatch):
    expected = ['SL_40_001 SL_90_001', 'SL_40_002 SL_90_002', 'SMT_40_001 SMT_90_001', 'SMT_40_002 SMT_90_002']
    assert grouped(tmp_path, nav='scripted') == expected
    assert grouped(tmp_path, tests=['SL']) == ['SL_40_001', 'SL_40_002', 'SL_90_001', 'SL_90_002']
    monkeypatch.setattr(module, 'MOST_TOGETHER', 2)
    groups = grouped(tmp_path, nav='scripted', tests=['SL'], ppr=[40, 90, 1024])
    assert [len(group.split()) for group in groups] == [2, 1, 2, 1]


@pytest.mark.parametrize(
    ('change', 'shared'),
    [
        ({'config.encoder.faults.missed': 0.01}, True),
        ({'config.wheel_diameter': 0.21}, True),
        ({'amcl.kld_err': 0.03}, True),  # no localization
        ({'lockstep.command': 0.03}, False),
        ({'simulator.lidar.noise': 0.02}, False),
        ({'config.odom_frame': 'odom_of_wheels'}, False),  # in /tf_static
        ({'amcl.global_frame_id': 'world'}, False),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else None,
)
def test_variants_share_a_drive_if_they_differ_behind_the_wheels(tmp_path, change, shared):
    changes = {'nav': 'scripted', 'tests': ['SL'], 'ppr': [40], 'trials': 1, 'variants': {'one': {}, 'two': change}}
    assert [group.count('SL_40') for group in grouped(tmp_path, **changes)] == ([2] if shared else [1, 1])


def changed(**packages):
    versions = get_versions(packages=PACKAGES)
    return {**versions, 'packages': {**versions['packages'], **packages}}


def test_a_broken_pool_is_replaced_and_its_environment_is_its_own():
    with local_workers(1) as workers:
        with pytest.raises(BrokenProcessPool):
            workers.submit(os._exit, 1).result()
        assert workers.submit(os.getenv, 'OMP_NUM_THREADS').result() == '1'
        assert workers.count() == 1
        worker = workers.submit(os.getpid).result()
        begin_s = time.monotonic()
        workers.submit(time.sleep, 60.0)
    assert time.monotonic() - begin_s < 30.0
    with pytest.raises(ProcessLookupError):
        os.kill(worker, 0)
    assert not set(ENVIRONMENT) & {name for name, value in os.environ.items() if value == '65536'}


def test_of_packages_versions_must_be_equal_and_of_python_minor_versions():
    check_versions(changed(), changed(), 'worker a')
    major, minor = str(changed()['packages']['python']).split('.')[:2]
    check_versions(changed(python=f'{major}.{minor}.99.final.0'), changed(), 'worker a')
    for name, version in (('numpy', '0.1'), ('numba', None), ('python', '2.7.18.final.0')):
        with pytest.raises(ConfigError, match=f'--scheduler: {name} is .* on worker a'):
            check_versions(changed(**{name: version}), changed(), 'worker a')


def test_without_dask_a_scheduler_is_an_error_that_names_the_extra_and_local_campaigns_run(monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(ConfigError, match=r'^--scheduler: needs Dask: distributed is not .*\[cluster\]'):
        with connected_workers('tcp://127.0.0.1:8786'):
            pass
    with local_workers(1) as workers:
        assert workers.submit(abs, -1).result() == 1
