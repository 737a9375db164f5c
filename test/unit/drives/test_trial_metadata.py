"""The trial that a bag was recorded from."""

from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.trial_recording import trial_of_source
from reencoding_drives import ROS2, drive, write_ros2
from trial_bags import STAMPED, TRUTH, trial, write_bag


def trial_of(path):
    with open_source(path) as source:
        return trial_of_source(path, source)


def test_a_bag_of_no_trial_says_nothing_of_one(tmp_path):
    assert trial_of(write_bag(tmp_path / 'a.bag', None)) is None
    assert trial_of(write_bag(tmp_path / 'b.bag', trial())) == trial()


def test_a_topic_of_another_type_is_no_trial(tmp_path):
    assert trial_of(write_bag(tmp_path / 'a.bag', None, more=[('/trial', STAMPED, None, TRUTH)])) is None


def test_a_bag_of_ros_2_has_a_trial(tmp_path):
    assert trial_of(write_ros2(tmp_path / 'none', drive(ROS2))) is None
    path = write_ros2(tmp_path / 'bag', [('/trial', 1, ROS2.text(trial().model_dump_json()))])
    assert trial_of(path) == trial()
