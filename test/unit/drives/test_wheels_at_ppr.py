"""One encoder with its odometry: what it reports, and tables of its errors."""

import csv
import json
import math

import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.bag_output import ReencodedBag
from diff_encoder_sim.drives.result_table import csv_table, text_table
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.trial_definition import with_encoder
from diff_encoder_sim.drives.wheels_at_ppr import WheelsAtPpr
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from reencoding_drives import JOINTS, START_NS, TICK_NS, angles_rad
from reencoding_runs import contents, samples_of
from trial_bags import trial


def wheels(ppr=90, **odometry):
    return WheelsAtPpr(PerWheel(left=ppr, right=ppr), EncoderParams(), OdometryParams(**odometry))


def test_it_reports_as_encoder_and_odometry_do():
    run, angles = wheels(), angles_rad(201)
    moved = [
        run.update(0, JointValues(START_NS + tick * TICK_NS, JOINTS, pair)) for tick, pair in enumerate(angles.tolist())
    ]
    odometry, samples = WheelOdometry(OdometryParams(ppr=90)), samples_of(angles, 90)
    estimates = [odometry.update(*sample) for sample in samples]
    assert run.reports == len(samples) == 41
    assert sum(moved) == sum(estimate is not None for estimate in estimates)
    assert run.stamped_pose == (estimates[-1].stamp_ns, estimates[-1].base_pose_in_odom)


def test_a_message_that_the_encoder_drops_is_refused():
    run = wheels()
    with pytest.raises(InputFault, match='finite angle'):
        run.update(0, JointValues(START_NS, JOINTS, (float('nan'), 0.0)))
    assert run.reports == 0


def test_the_trial_is_as_if_driven_with_this_encoder(tmp_path):
    run, recorded = wheels(1024, wheel_diameter=0.3), trial(odom='ideal')
    run.write_trial(0, recorded)  # nowhere
    with ReencodedBag(tmp_path / 'a.bag', JOINTS, OdometryParams()) as run.bag:
        run.write_trial(START_NS, recorded)
    [raw] = contents(tmp_path / 'a.bag')['/trial']
    expected = with_encoder(recorded, EncoderParams(ppr=1024), OdometryParams(wheel_diameter=0.3))
    assert (expected.ppr, expected.odom, expected.wheel_diameter) == (run.ppr, 'encoder', 0.3)
    assert json.loads(raw.decode()) == json.loads(expected.model_dump_json())
    assert expected.test == recorded.test


PERIOD_NS = 50_000_000


@pytest.fixture(name='runs')
def fixture_runs():
    """7 m in steps of a quarter, 1 % too long and 0.01 rad askew from the second pose on; and a run without errors."""
    runs = [WheelsAtPpr(PerWheel(left=ppr, right=ppr), EncoderParams(), OdometryParams()) for ppr in (90, 4096)]
    for index in range(29):
        x_m, yaw_rad = 0.25 * index, 0.01 if index else 0.0
        runs[0].comparison.take_reference(index * PERIOD_NS, Pose2D(x_m, 0.0, 0.0))
        runs[0].comparison.take_estimate(index * PERIOD_NS, Pose2D(1.01 * x_m, 0.0, yaw_rad))
    return runs


def test_terminal(runs):
    lines = [line.split() for line in text_table(runs).splitlines()]
    assert ['90', '0', '29', '0.0408', '0.0700', '0.563', '0.0700', '0.0000', '0.573'] in lines
    assert ['4096', '0', *'-------'] in lines
    five_m = [line for line in lines if line[1:3] == ['5', 'm']]
    assert [[line[0], line[3], line[6]] for line in five_m] == [['90', '1', '11']]
    assert ['90', '10', 'm', '0', '-', '-', '0', '-', '-'] in lines


def test_csv_is_exact_and_empty_where_there_is_nothing(runs):
    bent, empty = csv.DictReader(csv_table(runs).splitlines())
    assert float(bent['ate_max_m']) == pytest.approx(0.07)
    assert float(bent['reference_length_m']) == pytest.approx(7.0)
    assert float(bent['rpe_5m_yaw_rmse_rad']) == pytest.approx(0.01)
    assert int(bent['rpe_1m_segments']) == 7
    assert (bent['rpe_10m_position_rmse_m'], bent['rpe_10m_segments']) == ('', '0')
    assert float(bent['rpe_1m_position_rmse_m']) == pytest.approx(
        math.sqrt((0.01**2 + 6 * (1.01 * math.cos(0.01) - 1.0) ** 2 + 6 * (1.01 * math.sin(0.01)) ** 2) / 7)
    )
    assert (empty['ppr'], empty['ate_rmse_m'], empty['rpe_1m_segments']) == ('4096', '', '')
