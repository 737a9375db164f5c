"""One encoder with its odometry: what it reports, and the trial that its bag is of."""

import json

import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.bag_output import ReencodedBag
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
