"""References of drives: units, covariances, repeated stamps and parts, from bags and tables."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.csv_table import CsvStream
from diff_encoder_sim.drives.drive_stream import Message
from diff_encoder_sim.drives.message_decoders import POSE_TYPES
from diff_encoder_sim.drives.recorded_poses import PoseTopic
from diff_encoder_sim.drives.reference import TablePoses, read_reference
from reencoding_drives import MAKERS, ROS1

ODOMETRY = 'nav_msgs/msg/Odometry'
FULL = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, 0.25], [0.5, 0.25, 2.0]])


def of_table(tmp_path, rows, columns, has_yaw=True, length_m=1.0, angle_rad=1.0):
    path = tmp_path / 'camera.csv'
    path.write_text('\n'.join(rows))
    stream = CsvStream(path, columns, 's', '--reference-columns', is_ordered=False)
    return read_reference(TablePoses(stream, has_yaw, length_m, angle_rad))


def of_topic(maker, poses, covariance=None, kind=ODOMETRY):
    topic = PoseTopic('/camera', kind, maker.is_ros2)
    for stamp_ns, pose in poses:
        message = maker.pose(kind, stamp_ns, Pose2D(*pose))
        if covariance is not None:
            full = np.zeros((6, 6))
            full[np.ix_((0, 1, 5), (0, 1, 5))] = covariance
            message.pose.covariance[:] = full.ravel()
        topic.add(Message('/camera', 0, maker.raw(message)))
    return read_reference(topic)


def test_a_table_has_its_units_and_wraps_its_yaw(tmp_path):
    rows = ['t x y yaw a b c d e f', '0.5 100 -200 350 400 100 150 300 75 99', '1.5 300 0 -190 400 100 150 300 75 99']
    [found], notes = of_table(tmp_path, rows, ('t', 'x', 'y', 'yaw', *'abcdef'), True, 0.01, math.radians(1.0))
    assert (found.name, found.stamps_ns.tolist(), notes) == ('camera.csv', [500_000_000, 1_500_000_000], [])
    expected = [[1.0, -2.0, math.radians(-10.0)], [3.0, 0.0, math.radians(170.0)]]
    assert found.poses == pytest.approx(np.array(expected), abs=1e-12)
    units = np.array([0.01, 0.01, math.radians(1.0)])
    of_row = np.array([[400, 100, 150], [100, 300, 75], [150, 75, 99]]) * np.outer(units, units)
    assert found.covariances == pytest.approx(np.stack([of_row, of_row]))


def test_positions_without_yaw_have_none_and_keep_their_covariance(tmp_path):
    [found], _ = of_table(tmp_path, ['1 5 6 4 1 3', '2 6 6 4 1 3'], '123456', has_yaw=False)
    assert np.isnan(found.poses[:, 2]).all() and found.poses[:, :2].tolist() == [[5.0, 6.0], [6.0, 6.0]]
    assert np.array_equal(found.covariances[1, :2, :2], FULL[:2, :2]) and np.isnan(found.covariances[:, 2]).all()


def test_repeated_stamps_are_counted_and_bad_rows_named(tmp_path):
    rows = ['1,0,0,0', '1,9,9,9', '2,lost,0,0', '2,1,0,0', '2,9,9,9', '3,2,0,0']
    [found], notes = of_table(tmp_path, rows, '1234')
    assert found.poses[:, 0].tolist() == [0.0, 1.0, 2.0]
    assert notes[0].startswith('reference: 1 bad rows, in lines 3')
    assert notes[1] == 'reference: 2 of 5 poses repeat a stamp: using the first of each'


@pytest.mark.parametrize(('late_s', 'parts'), [(0.5, 1), (2.0, 2)])
def test_overtaken_rows_are_left_out_and_time_set_back_begins_a_part(tmp_path, late_s, parts):
    found, _ = of_table(tmp_path, ['5,0,0', '6,1,0', f'{6.0 - late_s},2,0', '7,3,0'], '123', has_yaw=False)
    assert len(found) == parts and all((np.diff(part.stamps_ns) > 0).all() for part in found)


@MAKERS
@pytest.mark.parametrize('kind', POSE_TYPES)
def test_covariances_of_messages_are_read_if_their_type_has_them(maker, kind):
    states = kind.endswith(('Odometry', 'WithCovarianceStamped'))
    [found], notes = of_topic(maker, [(7, (1.0, 2.0, 0.5)), (8, (2.0, 2.0, 0.5))], FULL if states else None, kind)
    assert found.poses == pytest.approx(np.array([[1.0, 2.0, 0.5], [2.0, 2.0, 0.5]])) and notes == []
    assert found.covariances is None if not states else np.array_equal(found.covariances, [FULL, FULL])


@pytest.mark.parametrize(
    ('diagonal', 'notes'), [((0, 0, 0), 0), ((1, 1, 0), 1), ((1, -1, 1), 1), ((1, math.nan, 1), 1)]
)
def test_covariances_that_are_none_are_ignored(diagonal, notes):
    [found], said = of_topic(ROS1, [(7, (1.0, 2.0, 0.5))], np.diag(np.array(diagonal, float)))
    assert found.covariances is None and len(said) == notes
