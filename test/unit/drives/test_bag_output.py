"""Bags that reencoding writes: what the nodes would have published, and memory that does not grow."""

import pytest

from diff_encoder_sim.drives.bag_output import COPIED
from diff_encoder_sim.drives.pose_messages import encode_odometry, encode_tf, encode_transform
from diff_encoder_sim.drives.sensor_messages import encode_encoder_pulse
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from reencoding_drives import JOINTS, ROS1, angles_rad, converted_to_ros2, drive, write_ros1
from reencoding_runs import contents, run, samples_of
from trial_bags import trial

PPRS = (40, 90, 1024)


@pytest.fixture
def bag(tmp_path):
    return write_ros1(tmp_path / 'drive.bag', drive())


def test_bags_hold_what_the_nodes_would_have_published(tmp_path, bag):
    run(bag, '--ppr', *PPRS, '--out', tmp_path / 'out')
    for ppr in PPRS:
        odometry = WheelOdometry(OdometryParams(ppr=ppr))
        samples = samples_of(angles_rad(501), ppr)
        estimates = [odometry.update(*sample) for sample in samples]
        found = contents(tmp_path / 'out' / (f'drive_{ppr}ppr.bag'))
        assert found == {
            '/world_pose': contents(bag)['/world_pose'],
            '/encoder_pulse': [encode_encoder_pulse(sample, JOINTS)[4:] for sample in samples],
            '/odom': [encode_odometry(estimate, 'odom', 'base_link')[4:] for estimate in estimates],
            '/tf': [
                encode_tf(encode_transform(estimate.base_pose_in_odom, estimate.stamp_ns, 'odom', 'base_link'))[4:]
                for estimate in estimates
            ],
        }
        assert len(samples) == 101


def test_a_trial_keeps_its_ppr_truth_and_result_through_rosbags_convert(tmp_path):
    """As --help promises: the PPR of --pulses is that of the recorded trial, also in a converted bag."""
    samples = [(stamp_ns, counts) for stamp_ns, *counts, _ in samples_of(angles_rad(501), 1024)]
    rows = drive() + [('/encoder_pulse', stamp_ns, ROS1.pulses(stamp_ns, counts)) for stamp_ns, counts in samples]
    about = trial(ppr={'left': 1024, 'right': 1024}).model_dump_json()
    texts = [('/trial', 1, ROS1.text(about)), ('/trial_result', 1, ROS1.text('{"outcome": "succeeded"}'))]
    bag = write_ros1(tmp_path / 'drive.bag', texts + sorted(rows, key=lambda row: row[1]))
    for path, out in ((bag, 'of_1'), (converted_to_ros2(bag, tmp_path / 'drive'), 'of_2')):
        run(path, '--pulses', '/encoder_pulse', '--ppr', '64', '--out', tmp_path / out)
    found = contents(tmp_path / 'of_2' / 'drive_64ppr.bag')
    assert found == contents(tmp_path / 'of_1' / 'drive_64ppr.bag')
    assert set(COPIED) < set(found)
