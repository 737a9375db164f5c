"""References of every kind."""

import math

import pytest

import reencoding_drives as drives
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.drives.message_decoders import POSE_TYPES
from reencoding_drives import POSE, ROS1, ROS2, START_NS, TICK_NS, angles_rad, complaint, drive, rows_of, run, write


@pytest.mark.parametrize('kind', POSE_TYPES)
@pytest.mark.parametrize('plugin', [None, 'sqlite3', 'mcap'])
def test_references_of_every_type_in_every_bag(tmp_path, kind, plugin):
    rows = drive(ROS2 if plugin else ROS1, reference='/truth', kind=kind)
    path = drives.write_ros2(tmp_path / 'a', rows, plugin) if plugin else write(tmp_path / 'a.bag', rows)
    run(path, '--ppr', '100000', '--reference', '/truth', '--out', tmp_path / 'out')
    (row,) = rows_of(tmp_path / 'out')
    assert row['common_stamps'] == '101' and float(row['ate_max_m']) < 1e-4


@drives.MAKERS
def test_two_frames_as_reference(tmp_path, maker):
    """map -> odom -> base -> base_link, the first moving now and then, the last fixed."""
    odom_in_map, link_in_base = Pose2D(1.0, 2.0, 0.3), Pose2D(0.0, 0.0, 0.2)
    rows = [('/tf_static', START_NS, maker.tf(maker.transform(0, link_in_base, 'base', 'base_link')))]
    for index, (topic, now_ns, message) in enumerate(drive(maker, reference=None)):
        rows.append((topic, now_ns, message))
        if index % 100 == 0:
            rows.append(('/tf', now_ns, maker.tf(maker.transform(now_ns + 10**9, odom_in_map, 'map', 'odom'))))
    for tick, pose in enumerate(drives.true_poses(angles_rad(501))):
        if tick % 5 == 0:
            now_ns = START_NS + tick * TICK_NS
            base_in_odom = pose.compose(link_in_base.inverse())
            rows.append(('/tf', now_ns, maker.tf(maker.transform(now_ns, base_in_odom, 'odom', 'base'))))
    rows.sort(key=lambda row: row[1])
    run(write(tmp_path / 'a', rows), '--ppr', '100000', '--reference', 'map->base_link', '--out', tmp_path / 'out')
    (row,) = rows_of(tmp_path / 'out')
    assert row['common_stamps'] == '101' and float(row['ate_max_m']) < 1e-4


def test_a_reference_of_another_time_is_told(tmp_path, capsys):
    pose = ROS1.pose(POSE, 1, IDENTITY)
    run(write(tmp_path / 'a.bag', [*drive(reference=None), ('/world_pose', START_NS, pose)]), '--ppr', '90')
    assert 'no pose of /world_pose has the stamp of an odometry message' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('option', 'frames'),
    [
        ('--odom', 'nosuch->odom'),
        *(('--reference', each) for each in ('map->nosuch', 'odom->map', 'base->laser', 'a->b')),
    ],
)
def test_frames_without_a_pose_are_refused_with_those_that_there_are(tmp_path, capsys, option, frames):
    """map -> odom moves, base -> laser is fixed, and nothing connects both."""
    rows = [
        (topic, START_NS, ROS1.tf(ROS1.transform(START_NS, IDENTITY, *names)))
        for topic, names in (('/tf_static', ('base', 'laser')), ('/tf', ('map', 'odom')))
    ]
    path = write(tmp_path / 'a.bag', [*drive(reference=None), *rows])
    option = '--odom' if frames.startswith('nosuch') else '--reference'
    text = complaint(capsys, path, '--ppr', '90', option, frames, '--out', tmp_path / 'out')
    assert option in text and frames in text and 'base, laser, map, odom' in text
    assert not list((tmp_path / 'out').glob('*'))


def test_a_truth_without_a_pose_that_no_option_names_is_not_compared_with(tmp_path, capsys):
    pose = ROS1.pose(POSE, START_NS, Pose2D(math.nan, 0.0, 0.0))
    run(write(tmp_path / 'a.bag', [*drive(reference=None), ('/world_pose', START_NS, pose)]), '--ppr', '90', '1024')
    assert 'compared with the odometry of the finest PPR' in capsys.readouterr().out
