"""Reading a trial's bag: the poses that rosbags itself decodes, and one line for a bag that is none."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.drives.trial_recording import read_trial, trial_of_source
from reencoding_drives import ROS2, drive, write
from trial_bags import ODOM, ODOMETRY, TRUTH, trial, write_bag


def refusal(path):
    with pytest.raises(ConfigError) as caught:
        read_trial(path)
    assert str(caught.value).startswith(f'{path}: ') and '\n' not in str(caught.value)
    return str(caught.value)


def test_every_series_is_read(tmp_path):
    recording = read_trial(write_bag(tmp_path / 'a.bag', trial(), amcl=TRUTH[:1], estimated=TRUTH[:2]))
    assert recording.trial == trial() and recording.outcome == Outcome.SUCCEEDED
    counts = {topic: len(series.stamps_ns) for topic, series in recording.poses.items()}
    assert counts == {'/odom': 3, '/world_pose': 3, '/amcl_pose': 1, '/global_pose': 2}
    assert recording.poses['/odom'].x_y_yaw == pytest.approx(np.array(ODOM))
    assert recording.poses['/odom'].stamps_ns.tolist() == [50_000_000, 100_000_000, 150_000_000]


def test_a_bag_of_any_kind_has_a_trial_or_none(tmp_path):
    others = drive(ROS2), [('/trial', 1, ROS2.text(trial().model_dump_json()))]
    paths = [write(tmp_path / f'{index}', rows) for index, rows in enumerate(others)]
    paths += [write_bag(tmp_path / f'{index}.bag', about) for index, about in enumerate((None, trial()))]
    assert [trial_of_source(open_source(path)) for path in paths] == [None, trial()] * 2


def test_a_bag_without_a_result_is_torn_and_silent_topics_are_left_out(tmp_path):
    recording = read_trial(write_bag(tmp_path / 'a.bag', trial(), result=None))
    assert recording.outcome == Outcome.TORN and set(recording.poses) == {'/odom', '/world_pose'}


@pytest.mark.parametrize(
    ('about', 'result', 'complaint'),
    [
        (None, 'succeeded', 'no /trial message'),
        ('{', 'succeeded', '/trial: not JSON'),
        ('[1]', 'succeeded', 'expected a JSON object'),
        ('{"test": 3}', 'succeeded', '/trial: test: given 3'),
        (trial(), 'won', "/trial_result: outcome: given 'won'; allowed: succeeded, collision"),
    ],
)
def test_what_is_asked_of_the_trial_must_be_there(tmp_path, about, result, complaint):
    assert complaint in refusal(write_bag(tmp_path / 'a.bag', about, result=result))


@pytest.mark.parametrize('row', [(0.0, math.inf, 0.0), (0.0, 0.0, math.nan)])
def test_poses_are_finite(tmp_path, row):
    said = refusal(write_bag(tmp_path / 'a.bag', trial(), odom=[ODOM[0], row]))
    assert '/odom: message 2: ' in said and said.endswith('expected a finite pose')


def test_two_robots_are_not_taken_for_one(tmp_path):
    spaces = write_bag(tmp_path / 'a.bag', trial(), more=[('/second/odom', ODOMETRY, None, ODOM)])
    assert refusal(spaces).endswith('odometry on /odom and /second/odom; expected one robot, on /odom')
    publishers = [('/odom', ODOMETRY, name, ODOM) for name in ('/one', '/two')]
    nodes = write_bag(tmp_path / 'b.bag', trial(), odom=(), more=publishers)
    assert '/odom is published by /one and /two; expected one robot' in refusal(nodes)
