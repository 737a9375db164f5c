"""Re-encoded drives: encoders, errors, tables, bags, and references of every kind."""

import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader

import reencoding_drives as drives
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries
from diff_encoder_sim.drives import reencoding
from diff_encoder_sim.drives.comparison import Comparison
from diff_encoder_sim.drives.message_decoders import POSE_TYPES
from diff_encoder_sim.drives.message_encoders import encode_encoder_pulse, encode_odometry, encode_planar_tf
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from places import ROOT
from reencoding_drives import JOINTS, MAKERS, ROS1, START_NS, TICK_NS, angles_rad, contents, drive, rows_of, run, write
from trial_bags import trial

PPRS = (40, 90, 1024)


@pytest.fixture
def bag(tmp_path):
    return write(tmp_path / 'drive.bag', drive())


@pytest.mark.parametrize('diameter_m', [0.2, {'left': 0.2, 'right': 0.201}])
def test_errors_and_bags_are_those_of_the_live_nodes(tmp_path, bag, capsys, diameter_m):
    wheels = {'wheel_diameter': diameter_m}
    (tmp_path / 'wheels.yaml').write_text(yaml.safe_dump(wheels))
    run(bag, '--ppr', *PPRS, '--out', tmp_path / 'out', '--config', tmp_path / 'wheels.yaml')
    truth, shown = drives.true_poses(angles_rad(501))[::5], capsys.readouterr().out
    for ppr, row in zip(PPRS, rows_of(tmp_path / 'out')):
        odometry, samples = WheelOdometry(OdometryParams(ppr=ppr, **wheels)), drives.samples_of(angles_rad(501), ppr)
        estimates = [odometry.update(*sample) for sample in samples]
        poses = [estimate.base_pose_in_odom for estimate in estimates]
        offsets = np.array([(pose.x_m - true.x_m, pose.y_m - true.y_m) for pose, true in zip(poses, truth)])
        assert (row['ppr'], row['common_stamps'], row['reports']) == (str(ppr), '101', '101')
        assert float(row['ate_rmse_m']) == pytest.approx(math.sqrt((offsets**2).sum(axis=1).mean()), abs=1e-12)
        assert [float(row['end_x_m']), float(row['end_y_m'])] == pytest.approx(offsets[-1].tolist(), abs=1e-12)
        assert f'{float(row["ate_rmse_m"]):.4f}' in shown
        assert contents(tmp_path / 'out' / f'drive_{ppr}ppr.bag') == {
            '/world_pose': contents(bag)['/world_pose'],
            '/encoder_pulse': [encode_encoder_pulse(sample, JOINTS)[4:] for sample in samples],
            '/odom': [encode_odometry(estimate, 'odom', 'base_link')[4:] for estimate in estimates],
            '/tf': [encode_planar_tf(each[1], each[0], 'odom', 'base_link')[4:] for each in estimates],
        }


def test_long_drives_have_the_same_errors_by_compiled_odometry(bag, capsys, monkeypatch):
    tables = []
    for few in (10**6, 0):
        monkeypatch.setattr(reencoding, 'FEW_REPORTS', few)
        run(bag, '--ppr', 40, 508.8)
        tables.append(capsys.readouterr().out.partition('counts')[2])
    assert tables[0] == tables[1]


def test_without_a_reference_the_recorded_wheels_are_one(tmp_path, capsys):
    run(write(tmp_path / 'a.bag', drive(reference=None)), '--ppr', '100000', '40', '--out', tmp_path / 'out')
    fine, coarse = rows_of(tmp_path / 'out')
    assert 0.0 < float(fine['ate_rmse_m']) < 1e-4 < float(coarse['ate_rmse_m']) < 0.05
    assert 'compared with the recorded wheel angles' in capsys.readouterr().out


def test_time_that_goes_back_begins_again_and_each_warning_is_printed_once(tmp_path, capsys):
    rows = drive(count=301)
    for _, _, message in rows[14:18]:  # between two reports
        message.position[0] = np.nan
    run(write(tmp_path / 'a.bag', rows + rows), '--ppr', *PPRS, '--out', tmp_path / 'out')
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(set(lines)) >= 3
    dropped = f'reencode: {tmp_path / "a.bag"}: /joint_states: 8 messages dropped; the first: joint'
    for words in (dropped, 'joint stamps went back 1 times, to 5.000 s', 'using config/config.yaml'):
        assert sum(words in line for line in lines) == 1
    for row in rows_of(tmp_path / 'out'):
        assert (row['reports'], row['common_stamps']) == ('122', '122') and float(row['ate_max_m']) < 0.05


def converted_to_ros2(path, to):
    """By rosbags-convert, whose options have changed between the versions of rosbags."""
    command = str(Path(sys.executable).with_name('rosbags-convert'))
    options = subprocess.run([command, '--help'], stdout=subprocess.PIPE, text=True, check=True).stdout
    source = ['--src', str(path)] if '--src' in options else [str(path)]
    subprocess.run([command, *source, '--dst', str(to)], check=True)
    return to


def test_a_trial_keeps_its_ppr_truth_and_result_through_rosbags_convert(tmp_path):
    """The PPR of --pulses is that of the recorded trial, also in a converted bag."""
    samples = [(stamp_ns, counts) for stamp_ns, *counts, _ in drives.samples_of(angles_rad(501), 1024)]
    rows = drive() + [('/encoder_pulse', stamp_ns, ROS1.pulses(stamp_ns, counts)) for stamp_ns, counts in samples]
    recorded = trial(ppr={'left': 1024, 'right': 1024}, odom='ideal')
    texts = {'/trial': recorded.model_dump_json(), '/trial_result': '{"outcome": "succeeded"}'}
    rows = [(topic, 1, ROS1.text(text)) for topic, text in texts.items()] + sorted(rows, key=lambda row: row[1])
    bag = write(tmp_path / 'drive.bag', rows)
    for path, out in ((bag, 'of_1'), (converted_to_ros2(bag, tmp_path / 'drive'), 'of_2')):
        run(path, '--pulses', '/encoder_pulse', '--ppr', '64', '--out', tmp_path / out)
    found = contents(tmp_path / 'of_2' / 'drive_64ppr.bag')
    assert found == contents(tmp_path / 'of_1' / 'drive_64ppr.bag') and set(reencoding.COPIED) < set(found)
    written = Trial.from_mapping(json.loads(found['/trial'][0].decode()), '')
    assert (written.ppr, written.odom, written.test) == (PerWheel(left=64, right=64), 'encoder', recorded.test)


def config(folder, **changes):
    path = folder / 'config.yaml'
    usual = yaml.safe_load((ROOT / 'config' / 'config.yaml').read_text())
    path.write_text(yaml.safe_dump({**usual, **changes}))
    return path


def messages(path, topic):
    with AnyReader([path]) as reader:
        return [reader.deserialize(raw, each.msgtype) for each, _, raw in reader.messages() if each.topic == topic]


@MAKERS
@pytest.mark.parametrize('is_commanded', [True, False])
def test_a_single_channel_counts_by_the_recorded_commands(tmp_path, capsys, maker, is_commanded):
    """A straight drive forward for 2 s, then backward, with a command before each."""
    rows = []
    for tick in range(401):
        now_ns, angle_rad = START_NS + tick * TICK_NS, 0.1 + 0.04 * (200 - abs(200 - tick))
        if is_commanded and tick in (0, 200):
            rows.append(('/cmd_vel', now_ns, maker.command(0.4 if tick == 0 else -0.4, 0.0)))
        rows.append(('/joint_states', now_ns, maker.joint_state(now_ns, (angle_rad, angle_rad))))
    given = config(tmp_path, encoder={'sensor': 'single_channel', 'decoding': 'x2'})
    run(write(tmp_path / 'drive', rows), '--ppr', '90', '--config', given, '--out', tmp_path / 'out')
    (path,) = (tmp_path / 'out').glob('*.bag')
    pulses, turned = [message.pulses.tolist() for message in messages(path, '/encoder_pulse')], 8.0 * 90 / (2 * np.pi)
    assert pulses[-1] == pytest.approx([1, 1] if is_commanded else [2 * turned] * 2, abs=4)
    assert max(left for left, _ in pulses) >= turned - 1
    assert capsys.readouterr().err.count('all counts are forward') == (not is_commanded)


def test_measured_speeds_are_written_and_not_taken_for_angles(tmp_path, bag):
    run(bag, '--ppr', '90', '--config', config(tmp_path, velocity_method='T'), '--out', tmp_path / 'out')
    (path,) = (tmp_path / 'out').glob('*.bag')
    speeds, pulses = messages(path, '/encoder_velocity'), messages(path, '/encoder_pulse')
    assert [message.header.stamp for message in speeds] == [message.header.stamp for message in pulses]
    assert speeds[-1].name == list(JOINTS) and len(speeds[-1].position) == 0
    turned_radps = (angles_rad(501)[-1] - angles_rad(501)[0]) / 5.0
    assert speeds[-1].velocity == pytest.approx(turned_radps, rel=1e-3)
    assert messages(path, '/odom')[-1].twist.twist.linear.x == pytest.approx(0.1 * turned_radps.mean(), rel=1e-3)
    run(path, '--pulses-ppr', '90', '--ppr', '40')  # finds the counts


def test_csv_is_exact_and_empty_without_a_value():
    """7 m in steps of a quarter, 1 % too long and 0.01 rad askew from the second pose; and no common stamps."""
    x_m, stamps_ns = 0.25 * np.arange(29), 50_000_000 * np.arange(29)
    bent = np.column_stack((1.01 * x_m, np.zeros(29), np.where(x_m > 0.0, 0.01, 0.0)))
    comparison, encoded = Comparison('r', [PoseSeries(stamps_ns, np.column_stack((x_m, np.zeros((29, 2)))))]), []
    for ppr, path in ((90, PoseSeries(stamps_ns, bent)), (4096, PoseSeries(stamps_ns[:0], bent[:0]))):
        encoder = reencoding.Encoder(ChosenEncoder(PerWheel(left=ppr, right=ppr)), EncoderParams(), OdometryParams())
        encoded.append(reencoding.EncodedDrive(encoder, 29, [path], comparison.errors([path])))
    bent, empty = csv.DictReader(reencoding.csv_table(reencoding.error_rows(encoded)).splitlines())
    found = [float(bent[key]) for key in ('ate_max_m', 'reference_length_m', 'rpe_5m_yaw_rmse_rad')]
    assert found == pytest.approx([0.07, 7.0, 0.01])
    counts = bent['rpe_1m_segments'], bent['rpe_10m_position_rmse_m'], bent['rpe_10m_segments']
    assert counts == ('7', '', '0')
    of_others = (1.01 * math.cos(0.01) - 1.0) ** 2 + (1.01 * math.sin(0.01)) ** 2
    assert float(bent['rpe_1m_position_rmse_m']) == pytest.approx(math.sqrt((0.01**2 + 6 * of_others) / 7))
    assert (empty['ppr'], empty['ate_rmse_m'], empty['rpe_1m_segments']) == ('4096', '', '')


@pytest.mark.parametrize('kind', POSE_TYPES)
@pytest.mark.parametrize('plugin', [None, 'sqlite3', 'mcap'])
def test_references_of_every_type_in_every_bag(tmp_path, kind, plugin):
    rows = drive(drives.ROS2 if plugin else ROS1, reference='/truth', kind=kind)
    path = drives.write_ros2(tmp_path / 'a', rows, plugin) if plugin else write(tmp_path / 'a.bag', rows)
    run(path, '--ppr', '100000', '--reference', '/truth', '--out', tmp_path / 'out')
    (row,) = rows_of(tmp_path / 'out')
    assert row['common_stamps'] == '101' and float(row['ate_max_m']) < 1e-4


@MAKERS
def test_two_frames_as_reference(tmp_path, maker):
    """map -> odom -> base -> base_link, the first moving now and then, the last fixed."""
    odom_in_map, link_in_base = Pose2D(1.0, 2.0, 0.3), Pose2D(0.0, 0.0, 0.2)
    rows = [('/tf_static', START_NS, maker.tf(maker.transform(0, link_in_base, 'base', 'base_link')))]
    for index, (topic, now_ns, message) in enumerate(drive(maker, reference=None)):
        rows.append((topic, now_ns, message))
        if index % 100 == 0:
            rows.append(('/tf', now_ns, maker.tf(maker.transform(now_ns + 10**9, odom_in_map, '/map', 'odom'))))
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
    pose = ROS1.pose(drives.POSE, 1, IDENTITY)
    run(write(tmp_path / 'a.bag', [*drive(reference=None), ('/world_pose', START_NS, pose)]), '--ppr', '90')
    assert '/world_pose is at 0.000 to 0.000 s, the wheels at 5.000 to 10.000 s' in capsys.readouterr().err


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
    text = drives.complaint(capsys, path, '--ppr', '90', option, frames, '--out', tmp_path / 'out')
    assert option in text and frames in text and 'base, laser, map, odom' in text
    assert not list((tmp_path / 'out').glob('*'))


def test_a_truth_without_a_pose_that_no_option_names_is_not_compared_with(tmp_path, capsys):
    pose = ROS1.pose(drives.POSE, START_NS, Pose2D(math.nan, 0.0, 0.0))
    run(write(tmp_path / 'a.bag', [*drive(reference=None), ('/world_pose', START_NS, pose)]), '--ppr', '90', '1024')
    assert 'compared with the recorded wheel angles' in capsys.readouterr().out
