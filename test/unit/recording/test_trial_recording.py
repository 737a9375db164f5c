"""Reading a trial's bag: the poses that rosbags itself decodes, and one line for a bag that is none."""

import math
import struct

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.recording.trial_recording import read_trial, stamped_pose, trial_of
from diff_encoder_sim.serialization.typestore import STORE
from diff_encoder_sim.trials.trial_outcome import Outcome
from trial_bags import ODOM, ODOMETRY, STAMPED, TRUTH, WITH_COVARIANCE, message, trial, write_bag


def refusal(path):
    with pytest.raises(ConfigError) as caught:
        read_trial(path)
    assert str(caught.value).startswith(f'{path}: ') and '\n' not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize('kind', [STAMPED, WITH_COVARIANCE, ODOMETRY])
@pytest.mark.parametrize('frame', ['', 'map', 'größer'])
def test_a_pose_is_what_rosbags_decodes(kind, frame):
    rng = np.random.default_rng(3)
    for row in rng.uniform(-3.0, 3.0, (20, 3)).tolist():
        raw = message(kind, row, int(rng.integers(2**31 * 10**9)), frame)
        decoded = STORE.deserialize_ros1(raw, kind)
        stamp, pose = decoded.header.stamp, getattr(decoded.pose, 'pose', decoded.pose)
        assert stamped_pose(raw, kind) == (
            stamp.sec * 10**9 + stamp.nanosec,
            pose.position.x,
            pose.position.y,
            pytest.approx(row[2]),
        )


def test_every_series_is_read(tmp_path):
    recording = read_trial(write_bag(tmp_path / 'a.bag', trial(), amcl=TRUTH[:1], believed=TRUTH[:2]))
    assert recording.trial == trial() and recording.outcome == Outcome.SUCCEEDED
    assert {topic: len(series.stamps_ns) for topic, series in recording.poses.items()} == {
        '/odom': 3,
        '/world_pose': 3,
        '/amcl_pose': 1,
        '/global_pose': 2,
    }
    assert recording.poses['/odom'].x_y_yaw == pytest.approx(np.array(ODOM))
    assert recording.poses['/odom'].stamps_ns.tolist() == [50_000_000, 100_000_000, 150_000_000]


def test_a_bag_without_a_result_is_torn_and_silent_topics_are_left_out(tmp_path):
    recording = read_trial(write_bag(tmp_path / 'a.bag', trial(), result=None))
    assert recording.outcome == Outcome.TORN and set(recording.poses) == {'/odom', '/world_pose'}


def test_an_unknown_outcome_is_refused(tmp_path):
    told = refusal(write_bag(tmp_path / 'a.bag', trial(), result='won'))
    assert "/trial_result: outcome: given 'won'; allowed: succeeded, collision" in told


def test_a_bag_of_no_trial_says_nothing_of_one(tmp_path):
    assert trial_of(write_bag(tmp_path / 'a.bag', None)) is None
    assert trial_of(write_bag(tmp_path / 'b.bag', trial())) == trial()


@pytest.mark.parametrize(
    ('about', 'complaint'),
    [
        (None, 'no /trial message; expected a bag that trial.launch or a campaign recorded'),
        ('{', '/trial: not JSON'),
        ('[1]', 'expected a JSON object'),
        ('{"test": 3}', '/trial: test: given 3'),
    ],
)
def test_what_is_asked_of_the_trial_must_be_there(tmp_path, about, complaint):
    assert complaint in refusal(write_bag(tmp_path / 'a.bag', about))


@pytest.mark.parametrize('row', [(math.nan, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, math.nan)])
def test_poses_are_finite(tmp_path, row):
    said = refusal(write_bag(tmp_path / 'a.bag', trial(), odom=[ODOM[0], row]))
    assert '/odom: message 2: ' in said and said.endswith('expected a finite pose')


def test_a_message_that_is_too_short_is_no_pose():
    with pytest.raises(struct.error):
        stamped_pose(message(STAMPED, (0.0, 0.0, 0.0), 0)[:-1], STAMPED)


def test_two_robots_are_not_taken_for_one(tmp_path):
    spaces = write_bag(tmp_path / 'a.bag', trial(), more=[('/second/odom', ODOMETRY, None, ODOM)])
    assert refusal(spaces).endswith('odometry on /odom and /second/odom; expected one robot, on /odom')
    nodes = write_bag(
        tmp_path / 'b.bag', trial(), odom=(), more=[('/odom', ODOMETRY, name, ODOM) for name in ('/one', '/two')]
    )
    assert '/odom is published by /one and /two; expected one robot' in refusal(nodes)


def test_a_topic_of_another_type_is_named(tmp_path):
    path = write_bag(tmp_path / 'a.bag', trial(), more=[('/amcl_pose', STAMPED, None, TRUTH)])
    assert '/amcl_pose is geometry_msgs/msg/PoseStamped' in refusal(path)
    assert 'expected geometry_msgs/msg/PoseWithCovarianceStamped' in refusal(path)


@pytest.mark.parametrize('content', [b'', b'hello', b'\xff\xfe', b'#ROSBAG V2.0\n', b'#ROSBAG V2.0\n' + b'x' * 5000])
def test_a_file_that_is_no_bag_is_named(tmp_path, content):
    path = tmp_path / 'bad.bag'
    path.write_bytes(content)
    refusal(path)


def test_a_bag_that_is_not_there_is_named(tmp_path):
    assert refusal(tmp_path / 'no.bag').endswith('no such bag')


def test_a_bag_cut_off_anywhere_is_named(tmp_path):
    whole = write_bag(tmp_path / 'whole.bag', trial()).read_bytes()
    path = tmp_path / 'cut.bag'
    for length in range(0, len(whole), 97):
        path.write_bytes(whole[:length])
        refusal(path)


def test_a_damaged_bag_is_read_or_named(tmp_path):
    whole = write_bag(tmp_path / 'whole.bag', trial()).read_bytes()
    rng, path, refused = np.random.default_rng(5), tmp_path / 'damaged.bag', 0
    for position, value in zip(rng.integers(len(whole), size=300).tolist(), rng.integers(256, size=300).tolist()):
        for damage, lost in ((bytes([value]), 1), (bytes(200), value)):
            path.write_bytes(whole[:position] + damage + whole[position + lost :])
            try:
                read_trial(path)
            except ConfigError as error:
                refused += 1
                assert str(error).startswith(f'{path}: ') and '\n' not in str(error)
    assert refused > 50
