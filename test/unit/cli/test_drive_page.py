"""The page of a recorded drive, by reencode of a table and by analyze of a bag without a trial."""

import json
import re

import numpy as np
import pytest

from browser import NEEDS_BROWSER, opened_page
from calibration_drives import TrueRobot, referenced_drive
from diff_encoder_sim.analysis.charts import chart_page
from diff_encoder_sim.base.se2 import Pose2D, poses_of_wheels
from diff_encoder_sim.cli import analyze, reencode
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.wheels.odometry import OdometryEstimate

DRIVE = referenced_drive(TrueRobot(0.2, 0.2, 0.4, 0.0, 0.0, 0.0, 0.0, 1e-7, 1e-7), np.random.default_rng(1), 60.0)
ASSUMED = 'set: {config.wheel_diameter: 0.2, config.wheel_separation: 0.412}\n'


@pytest.fixture(name='table')
def fixture_table(tmp_path):
    """The arguments for a drive's table, with a separation that is 3 % too large."""
    stamps_ns, reference = DRIVE.drive.stamps_ns, DRIVE.reference
    x_y_yaw = [np.interp(stamps_ns, reference.stamps_ns, column) for column in np.unwrap(reference.poses, axis=0).T]
    rows = np.column_stack((1e-9 * stamps_ns, DRIVE.drive.wheel_angles_rad, *x_y_yaw))[60:-60:2]
    np.savetxt(tmp_path / 'drive.csv', rows, fmt='%.6f', delimiter=',', header='t,left,right,x,y,yaw', comments='')
    (tmp_path / 'robot.yaml').write_text(ASSUMED)
    columns = ['--columns', 't', 'left', 'right', '--unit', 'rad']
    return ['--csv', str(tmp_path / 'drive.csv'), *columns, '--robot', str(tmp_path / 'robot.yaml')]


def content_of(page):
    text = page.read_text(encoding='utf-8')
    return text, json.loads(re.search(r'<script type="application/json">(.*?)</script>', text, re.S)[1])


def test_reencode_writes_and_prints_the_cause(table, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(chart_page, 'VALIDATE', True)
    options = f'--reference-columns t x y yaw --ppr 40 4096 --out {tmp_path / "out"}'
    reencode.main([*table, *options.split()])
    printed, (page, content) = capsys.readouterr().out, content_of(tmp_path / 'out' / 'drive.html')
    sentence = re.search(r'heading drifts by -1\d\.\d+ degrees per turn: check the wheel separation', printed)[0]
    assert sentence in page and str(tmp_path / 'out' / 'drive.html') in printed
    assert [chart['name'] for chart in content['charts']] == ['path', 'error', 'spread', 'budget']
    assert content['choices'][0]['values'] == ['40', '4096', 'corrected']
    assert 'separation 0.412 m' in page and 'Budget' in page


@NEEDS_BROWSER
@pytest.mark.parametrize('width_px', [1280, 390])
def test_the_page_is_not_cut(width_px, table, tmp_path):
    path = tmp_path / 'page.html'
    reencode.main([*table, *f'--reference-columns t x y yaw --ppr 40 4096 --page {path}'.split()])
    with opened_page(tmp_path / 'profile') as page:
        page.open(path, width_px)
        page.wait_for('document.querySelectorAll(".charts.drawn figure svg").length === 4')
        assert page.evaluate('document.documentElement.scrollWidth') <= width_px
        assert page.cut_texts() == page.complaints() == []


def test_without_a_reference_no_cause_is_named(table, tmp_path, capsys):
    page = tmp_path / 'page.html'
    reencode.main([*table, '--ppr', '40', '--draws', '5', '--page', str(page)])
    text, content = content_of(page)
    sentence = 'Without a reference, errors are relative to the recorded wheel angles'
    assert sentence in text and sentence in capsys.readouterr().out
    assert [chart['name'] for chart in content['charts']] == ['path', 'error', 'spread']


def test_a_reference_without_yaw_shows_no_heading_and_the_same_cause(table, tmp_path):
    options = f'--reference-columns t x y --ppr 40 --page {tmp_path / "page.html"}'
    reencode.main([*table, *options.split()])
    text, content = content_of(tmp_path / 'page.html')
    assert 'degrees per turn: check the wheel separation' in text
    assert content['choices'][1]['values'] == ['position']


@pytest.mark.parametrize('has_odometry', [True, False])
def test_analyze_compares_the_bag_of_a_drive_with_the_poses_of_a_sensor(has_odometry, tmp_path, capsys):
    """By the bag's /odom, with a separation 3 % too large; without, by the wheels."""
    odometry = poses_of_wheels(DRIVE.drive.wheel_angles_rad[np.newaxis], 0.1, 0.1, 0.412, 0.0, False)[0]
    joints = 'left_wheel_joint', 'right_wheel_joint'
    with TrialBag(tmp_path / 'drive.bag', 'full') as bag:
        for stamp_ns, angles, pose in zip(DRIVE.drive.stamps_ns.tolist(), DRIVE.drive.wheel_angles_rad, odometry):
            states = JointStates(stamp_ns, joints, tuple(angles.tolist()), (0.0, 0.0))
            about = (topics.JOINT_STATES, topics.SIMULATOR_NODE, stamp_ns, encoders.encode_joint_state, states)
            bag.publish(*about)
            if has_odometry:
                moved = OdometryEstimate(stamp_ns, Pose2D(*pose.tolist()), 0.0, 0.0), 'odom', 'base_link'
                bag.publish(topics.ODOM, topics.ODOM_NODE, stamp_ns, encoders.encode_odometry, *moved)
        for stamp_ns, pose in zip(DRIVE.reference.stamps_ns.tolist(), DRIVE.reference.poses.tolist()):
            about = (Pose2D(*pose), stamp_ns, 'map')
            bag.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, stamp_ns, encoders.encode_pose_stamped, *about)
    analyze.main([str(tmp_path if has_odometry else tmp_path / 'drive.bag'), '--out', str(tmp_path / 'made')])
    printed, text = capsys.readouterr().out, (tmp_path / 'made' / 'drive.html').read_text(encoding='utf-8')
    assert ('degrees per turn: check the wheel separation: 0.97' in printed) == has_odometry
    assert f'Report: {tmp_path / "made" / "drive.html"}' in printed and '<h1>drive.bag</h1>' in text
