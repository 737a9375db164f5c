"""Trials from their plans to their rows and bags; those of one drive have the same as if they ran separately."""

import hashlib
import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials import trial_run
from diff_encoder_sim.trials.campaign_cells import LockstepOptions, TrialSetup
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.results import ResultsFolder
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from diff_encoder_sim.trials.trial_run import run_group, run_trials
from diff_encoder_sim.trials.trials_csv import TrialRow
from diff_encoder_sim.wheels.encoder_params import EncoderModel, FaultParams
from diff_encoder_sim.wheels.report_link import ReportParams
from lockstep_trials import ALTO, HALL, params_of, plan_of, run_trial
from places import CONFIG

LINE = {'nav': 'scripted', 'drive': [{'straight': 1.0}]}
TURN = {'nav': 'scripted', 'drive': [{'turns': 0.25}, {'straight': -0.3}]}
WALL = {'nav': 'scripted', 'start': {'x': -3.0, 'y': 2.2, 'yaw': math.pi / 2}, 'drive': [{'straight': 3.0}]}
POSE = Pose2D(0.1, 0.2, 0.3)
ERRORS = {PoseSource.ODOM: POSE, PoseSource.AMCL: None, PoseSource.GLOBAL: None, PoseSource.WORLD: POSE}


def setup(bag, ppr, drive, bag_format='ros1', record='full', latency_s=0.0, **encoder):
    params, plan = params_of(), plan_of(HALL, ppr, bag=bag, **drive).model_copy(update={'bag_format': bag_format})
    latency = params.latency.model_copy(update={'odometry': latency_s})
    params = params._replace(encoder=params.encoder.model_copy(update=encoder), latency=latency)
    return TrialSetup(plan, params, LockstepOptions(record=record))


def setups(folder, drive, *output):
    """Encoders of several resolutions: with errors, with reports that come late or never, with measured speeds."""
    folder.mkdir()
    faulty = EncoderModel(direction='command', phase_error=20.0, faults=FaultParams(missed=0.1, extra=0.05))
    late = ReportParams(latency=0.03, latency_spread=0.06, lost=0.1, repeated=0.1, reordered=0.1)
    return [
        setup(folder / '40', 40, drive, *output),
        setup(folder / '1024', 1024, drive, *output, latency_s=0.03),
        setup(folder / 'faulty', 90, drive, *output, encoder=faulty),
        setup(folder / 'late', 90, drive, *output, report=late),
        setup(folder / 'slow', 1000, drive, *output, rate=10.0, velocity_method='T'),
    ]


@pytest.mark.parametrize(
    ('drive', 'bag_format', 'record'),
    [(LINE, 'ros1', 'full'), (TURN, 'mcap', 'full'), (WALL, 'ros1', 'minimal'), (TURN, 'ros1', 'none')],
    ids=['line', 'turn', 'wall', 'unrecorded'],
)
def test_each_has_the_result_and_the_bag_that_it_has_alone(tmp_path, drive, bag_format, record):
    together = run_trials(setups(tmp_path / 'together', drive, bag_format, record), ALTO)
    alone = [run_trials([each], ALTO)[0] for each in setups(tmp_path / 'alone', drive, bag_format, record)]
    assert together == alone
    assert {result.outcome for result in alone} == {Outcome.COLLISION if drive is WALL else Outcome.SUCCEEDED}
    assert len({result.errors[source] for result in alone for source in result.errors}) > len(alone)
    bags = [{path.name: path.read_bytes() for path in (tmp_path / name).iterdir()} for name in ('together', 'alone')]
    assert bags[0] == bags[1]
    assert len(set(bags[0].values())) == (0 if record == 'none' else len(alone))


def test_a_trial_that_cannot_be_run_or_written_leaves_no_bag(tmp_path):
    with pytest.raises(ConfigError, match='nav upstream'):
        run_trial(plan_of(HALL, nav='upstream', bag=tmp_path / 'refused.bag'), ALTO, params_of(), 'minimal')
    (tmp_path / 'taken').mkdir()
    with pytest.raises(OSError, match='taken'):
        run_trials([setup(tmp_path / '1', 40, LINE), setup(tmp_path / 'taken', 90, LINE)], ALTO)
    assert [path.name for path in tmp_path.iterdir()] == ['taken']


def test_a_scripted_trial_has_errors_by_each_pose_source_that_it_has():
    plan = plan_of(HALL, 1024, nav='scripted', start={'x': -3.0, 'yaw': math.pi / 2}, drive=[{'straight': 0.5}])
    result = run_trial(plan, ALTO, params_of(), 'none')
    assert result.outcome is Outcome.SUCCEEDED
    assert result.distance_m == pytest.approx(0.5, abs=1e-3)
    # A trapezoid of 0.5 m, half a second's pause, a second at rest.
    assert result.duration_s == pytest.approx(0.5 / 0.45 + 0.45 / 0.7 + 0.5 + 1.0, abs=0.1)
    assert result.errors[PoseSource.AMCL] is None
    for source in (PoseSource.ODOM, PoseSource.GLOBAL, PoseSource.WORLD):
        assert result.errors[source] == pytest.approx((0.0, 0.0, 0.0), abs=2e-3), source


@pytest.mark.parametrize('nav', ['scripted', 'embedded'])
def test_wheels_whose_axes_point_the_other_way_count_forward(tmp_path, nav):
    mirrored = tmp_path / 'mirrored.urdf.xacro'
    mirrored.write_text(ALTO.read_text().replace('<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>'))
    params = params_of()
    params = params._replace(encoder=params.encoder.model_copy(update={'left_reversed': True, 'right_reversed': True}))
    result = run_trial(plan_of(HALL, 1024, nav=nav, drive=[{'straight': 3.0}]), mirrored, params, 'none')
    assert result.errors[PoseSource.ODOM] == pytest.approx(result.errors[PoseSource.WORLD], abs=0.05)


UNEQUAL_M, HEADING_RAD = {'left': 0.2, 'right': 0.204}, 3.0 * 0.004 / 0.202 / 0.4  # after 3 m


@pytest.mark.parametrize(('nav', 'assumed_m', 'heading_rad'), [
    ('scripted', UNEQUAL_M, 0.0),
    ('scripted', 0.202, -HEADING_RAD),
    ('embedded', UNEQUAL_M, 0.0),
])  # fmt: skip
def test_odometry_of_unequal_wheels_is_right_if_it_knows_them(nav, assumed_m, heading_rad):
    settings = {'simulator.wheel_diameter': UNEQUAL_M, 'config.wheel_diameter': assumed_m}
    params = override(load_robot_config(CONFIG), settings)
    result = run_trial(plan_of(HALL, 4096, nav=nav, drive=[{'straight': 3.0}]), ALTO, params, 'none')
    odometry, truth = result.errors[PoseSource.ODOM], result.errors[PoseSource.WORLD]
    assert odometry.yaw_rad - truth.yaw_rad == pytest.approx(heading_rad, abs=4e-3)
    assert odometry.y_m - truth.y_m == pytest.approx(0.5 * 3.0 * heading_rad, abs=0.01)


def stub_trial(plan, robot_file):
    assert Path(plan.world).is_file() and Path(plan.map).is_file() and robot_file.is_file()
    Path(plan.bag).write_bytes(b'bag of %d' % plan.trial.number)
    return TrialRow('', '', (), 0, 0, Outcome.LOST, 'no idea', 48.5, ERRORS, float(plan.trial.number))


@pytest.mark.parametrize('is_shared', [True, False])
def test_bags_are_in_a_shared_folder_or_returned_and_rows_have_their_part_of_the_time(tmp_path, monkeypatch, is_shared):
    (tmp_path / 'bags').mkdir()
    (tmp_path / 'manifest.json').write_text('{}')
    monkeypatch.setattr(trial_run, 'time', SimpleNamespace(perf_counter=iter([100.0, 106.0]).__next__))
    campaign = load_campaign('paper', package_folder(), {'tests': ['SL'], 'ppr': [40.0], 'trials': 3})
    folder = ResultsFolder(str(tmp_path), hashlib.sha256(b'{}' if is_shared else b'of another run').hexdigest())
    files = campaign.files.materialise(tmp_path / 'scratch')
    run = lambda setups, robot: [stub_trial(plan, robot) for plan, *_ in setups]  # noqa: E731
    rows, bags = zip(*run_group(files, campaign.trials(), folder, run))
    written = [path.read_bytes() for path in sorted((tmp_path / 'bags').iterdir())]
    contents = [b'bag of 1', b'bag of 2', b'bag of 3']
    assert (written, [*bags]) == ((contents, [None] * 3) if is_shared else ([], contents))
    assert not list((tmp_path / 'scratch').rglob('*.bag*'))
    assert [row.bag for row in rows] == [f'bags/SL_40_00{number}.bag' for number in (1, 2, 3)]
    assert rows[1][:8] == ('SL', '40', (), 2, 2, Outcome.LOST, 'no idea', 48.5)
    assert (rows[1].errors, rows[1].distance_m, rows[1].wall_time_s) == (ERRORS, 2.0, 2.0)
