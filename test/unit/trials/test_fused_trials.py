"""Trials with fusion: their bags, rows and analysis have the fused odometry, and the wheels' stays as without it."""

import math

import pytest

from diff_encoder_sim.analysis.results_loading import read_bag_trials
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.imu import imu_settings
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_cells import LockstepOptions, TrialSetup
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from diff_encoder_sim.trials.trial_run import run_trials
from lockstep_trials import ALTO, HALL, plan_of
from places import CONFIG, ROOT
from reencoding_drives import contents, rows_of, run

IMU = override(load_robot_config(CONFIG), imu_settings('mpu6050', CONFIG, ROOT))
CURVE = {'drive': [{'straight': 1.0}, {'turns': 0.5}]}


def setup(bag, fusion, params=IMU, nav='scripted', **drive):
    plan = plan_of(HALL, 90, bag=bag, nav=nav, **drive)
    trial = plan.trial.model_copy(update={'fusion': fusion})
    return TrialSetup(plan.model_copy(update={'trial': trial}), params, LockstepOptions(record='full'))


@pytest.fixture(scope='module', params=['scripted', 'embedded'])
def trials(request, tmp_path_factory):
    """(paths of bags, rows) by fusion, of one drive if it is scripted."""
    folder = tmp_path_factory.mktemp(request.param)
    drive = CURVE if request.param == 'scripted' else {}
    paths = {fusion: folder / f'{fusion}.bag' for fusion in ('none', 'embedded')}
    rows = run_trials([setup(path, fusion, nav=request.param, **drive) for fusion, path in paths.items()], ALTO)
    return paths, dict(zip(paths, rows))


def test_the_row_and_the_bag_have_the_fused_odometry(trials):
    paths, rows = trials
    row = rows['embedded']
    assert (row.outcome, rows['none'].outcome) == (Outcome.SUCCEEDED, Outcome.SUCCEEDED)
    of_bag = read_bag_trials([paths['embedded']])[0].record
    truth, odom, of_wheels = row.errors[PoseSource.WORLD], row.errors[PoseSource.ODOM], contents(paths['embedded'])
    assert [of_bag[f'odom_{part}'] for part in ('x_m', 'y_m', 'yaw_rad')] == pytest.approx(list(odom), abs=1e-12)
    assert abs(odom.yaw_rad - truth.yaw_rad) < math.radians(0.5)  # of the wheels, 90 counts: 0.3 to 1
    assert len(of_wheels['/odometry/filtered']) == len(of_wheels['/odom']) == len(of_wheels['/encoder_pulse'])
    transforms = [raw for raw in of_wheels['/tf'] if b'base_link' in raw and b'odom' in raw]
    assert len(transforms) == len(of_wheels['/odom'])


def test_without_fusion_nothing_changes(trials):
    paths, _ = trials
    without_imu = paths['none'].with_name('without_imu.bag')
    drive = CURVE if 'scripted' in str(paths['none']) else {}
    nav = 'scripted' if drive else 'embedded'
    run_trials([setup(without_imu, 'none', nav=nav, **drive)], ALTO)
    assert without_imu.read_bytes() == paths['none'].read_bytes()


def test_reencoding_with_the_recorded_rates_gives_the_same_fused_odometry(trials, tmp_path, capsys):
    paths, _ = trials
    imu = '--fusion', 'embedded', '--imu', 'mpu6050'
    run(paths['none'], '--ppr', 90, *imu, '--out', tmp_path)
    (bag,) = tmp_path.glob('*.bag')
    original, again = contents(paths['embedded']), contents(bag)
    if 'scripted' in str(paths['none']):  # a navigated robot drives by its odometry
        assert again['/odometry/filtered'] == original['/odometry/filtered']
    wheels, fused = rows_of(tmp_path)
    assert (wheels['ppr'], fused['ppr']) == ('90', '90 fused')
    assert float(fused['yaw_rmse_rad']) < float(wheels['yaw_rmse_rad'])


def test_fusion_needs_an_imu_and_runs_in_lockstep_only_embedded():
    with pytest.raises(ConfigError, match=r'^fusion: given embedded without an IMU; allowed: with an IMU'):
        run_trials([setup('', 'embedded', override(load_robot_config(CONFIG), {}), **CURVE)], ALTO)
    with pytest.raises(ConfigError, match=r'^lockstep: given .* fusion upstream'):
        LockstepTrial(setup('', 'upstream', **CURVE).plan, ALTO, IMU)
