"""The trial that a bag was recorded from: the same by its index and as a stream."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.recording.bag_source import open_source
from diff_encoder_sim.recording.trial_metadata import trial_of, trial_of_source
from reencoding_drives import ROS2, drive, write_ros2
from trial_bags import STAMPED, TRUTH, trial, write_bag


def streamed_trial_of(path):
    with open_source(path) as source:
        return trial_of_source(path, source)


READERS = pytest.mark.parametrize('read', [trial_of, streamed_trial_of])


@READERS
def test_a_bag_of_no_trial_says_nothing_of_one(tmp_path, read):
    assert read(write_bag(tmp_path / 'a.bag', None)) is None
    assert read(write_bag(tmp_path / 'b.bag', trial())) == trial()


@READERS
@pytest.mark.parametrize(
    ('text', 'complaint'),
    [
        ('{', '/trial: not JSON'),
        ('[1]', "/trial: given '[1]'; expected a JSON object"),
        ('{"test": 3}', '/trial: test: given 3'),
    ],
)
def test_a_trial_that_is_none_is_named(tmp_path, read, text, complaint):
    path = write_bag(tmp_path / 'a.bag', text)
    with pytest.raises(ConfigError) as caught:
        read(path)
    assert str(caught.value).startswith(f'{path}: {complaint}') and '\n' not in str(caught.value)


@READERS
def test_how_a_trial_ended_does_not_matter_for_what_it_was(tmp_path, read):
    assert read(write_bag(tmp_path / 'a.bag', trial(), result=None)) == trial()


def test_a_topic_of_another_type_is_refused_by_its_index_and_none_in_a_stream(tmp_path):
    path = write_bag(tmp_path / 'a.bag', None, more=[('/trial', STAMPED, None, TRUTH)])
    with pytest.raises(ConfigError, match=r'/trial is geometry_msgs/msg/PoseStamped'):
        trial_of(path)
    assert streamed_trial_of(path) is None


def test_a_bag_of_ros_2_has_a_trial_in_a_stream(tmp_path):
    of_none = write_ros2(tmp_path / 'none', drive(ROS2))
    assert streamed_trial_of(of_none) is None
    path = write_ros2(tmp_path / 'bag', [('/trial', 1, ROS2.text(trial().model_dump_json()))])
    assert streamed_trial_of(path) == trial()
    with pytest.raises(ConfigError, match=r"a ROS 2 bag; expected a trial's, of ROS 1"):
        trial_of(path)
