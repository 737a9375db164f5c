"""UMBmark: by the paper's equations, by exact arcs, and in closed loop with a simulated robot."""

import json
import math

import numpy as np
import pytest

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D, move_along_arc
from diff_encoder_sim.calibration.umbmark import WheelGeometry, find_squares, read_ends, squares_of_ends, umbmark
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.simulation.state import TICK_NS, TICK_S
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from places import CONFIG, ROOT, WORLDS

NOMINAL = WheelGeometry(0.2, 0.2, 0.4)
SIDE_M = 4.0
STATE_TICKS = 5


def true_end(e_d, e_b, side):
    """(2,) of a square that odometry with NOMINAL closes; `side` is 1 for counter-clockwise, -1 for clockwise."""
    left, right = 2.0 / (1.0 + e_d), 2.0 * e_d / (1.0 + e_d)  # true over nominal diameters
    pose, separation_m = Pose2D(0.0, 0.0, 0.0), e_b * NOMINAL.separation_m
    for _ in range(4):
        pose = move_along_arc(pose, SIDE_M, SIDE_M * (right - left) / separation_m)
        rim_m = side * 0.25 * math.pi * NOMINAL.separation_m
        pose = move_along_arc(pose, 0.5 * rim_m * (right - left), rim_m * (right + left) / separation_m)
    return pose[:2]


def result(e_d, e_b):
    return umbmark(squares_of_ends([true_end(e_d, e_b, -1)], [true_end(e_d, e_b, 1)], SIDE_M, NOMINAL), NOMINAL)


def test_small_errors_are_those_of_the_papers_equations():
    e_d, e_b = 1.0002, 1.0005
    found = result(e_d, e_b)
    (x_cw_m, y_cw_m), (x_ccw_m, y_ccw_m) = found.centres_m
    alpha = 0.5 * (x_cw_m + x_ccw_m + y_cw_m - y_ccw_m) / (-4.0 * SIDE_M)  # equations for x and for y, averaged
    beta = 0.5 * (x_cw_m - x_ccw_m + y_cw_m + y_ccw_m) / (-4.0 * SIDE_M)
    radius_m, half_m = 0.5 * SIDE_M / math.sin(0.5 * beta), 0.5 * NOMINAL.separation_m
    assert found.e_d - 1.0 == pytest.approx((radius_m + half_m) / (radius_m - half_m) - 1.0, rel=0.02)
    assert found.e_b - 1.0 == pytest.approx(0.5 * math.pi / (0.5 * math.pi - alpha) - 1.0, rel=0.02)


@pytest.mark.parametrize(('e_d', 'e_b'), [(1.03, 0.97), (0.97, 0.98), (1.002, 1.03), (1.0, 1.0)])
def test_errors_of_per_cents_are_found_exactly_and_the_mean_diameter_stays(e_d, e_b):
    found = result(e_d, e_b)
    assert (found.e_d, found.e_b) == pytest.approx((e_d, e_b), rel=1e-6)
    assert found.e_max_m[1] < 1e-5
    assert found.corrected[0] + found.corrected[1] == pytest.approx(0.4, rel=1e-9)
    expected = (0.4 / (1.0 + e_d), 0.4 * e_d / (1.0 + e_d), 0.4 * e_b)
    assert found.corrected == pytest.approx(expected, rel=1e-6)
    values = json.loads(json.dumps(found.as_json()))
    assert values['e_max_syst_before_m'] == found.e_max_m[0]
    assert values['wheel_separation_m'] == pytest.approx(0.4 * e_b, rel=1e-6)
    assert f'{found.e_max_m[0]:.4f} m before' in found.text()


def test_centres_are_means_and_the_largest_counts():
    ends_cw, ends_ccw = np.array([(0.1, 0.0), (0.3, 0.0)]), np.array([(0.0, 0.1), (0.0, 0.05), (0.0, 0.0)])
    found = umbmark(squares_of_ends(ends_cw, ends_ccw, SIDE_M, NOMINAL), NOMINAL)
    assert found.squares == (2, 3)
    assert found.centres_m == pytest.approx(np.array([(0.2, 0.0), (0.0, 0.05)]))
    assert found.e_max_m[0] == pytest.approx(0.2)
    with pytest.raises(ConfigError, match='given 2 clockwise and 0 counter-clockwise; allowed: at least one of each'):
        umbmark(squares_of_ends(ends_cw, [], SIDE_M, NOMINAL), NOMINAL)


def driven(true, nominal, seed):
    """The test UMBMARK by a robot whose controller assumes the nominal geometry."""
    test = load_test('UMBMARK', CONFIG)
    left, right, separation = (true_m / nominal_m - 1.0 for true_m, nominal_m in zip(true, nominal))
    errors = {'left_radius_error': left, 'right_radius_error': right, 'wheel_separation_error': separation}
    diameter = {'left': nominal.left_diameter_m, 'right': nominal.right_diameter_m}
    known = {'wheel_diameter': diameter, 'wheel_separation': nominal.separation_m, 'wheel_errors': errors}
    params = SimulatorParams.from_mapping(known, '')
    files = WORLDS / 'open_floor.world', RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')
    simulator, script = Simulator(*files, params, test.start.pose(), seed), ScriptedDrive(test)
    rows = []
    while not script.is_over(TICK_S * STATE_TICKS * len(rows)):
        simulator.command(*script.command_at(TICK_S * STATE_TICKS * len(rows), TICK_S * STATE_TICKS))
        rows.append((*simulator.joint_states().angles_rad, *simulator.physics.base_pose_in_plane()))
        for _ in range(STATE_TICKS):
            simulator.tick()
    assert simulator.physics.obstacle_hit() is None
    simulator.close()
    stamps_ns = TICK_NS * STATE_TICKS * np.arange(len(rows))
    every = stamps_ns[1::2], np.array(rows)[1::2, 2:]  # the reference is slower
    return Drive(stamps_ns, np.array(rows)[:, :2]), Reference('truth', *every)


def test_in_closed_loop_the_systematic_error_falls_to_a_tenth():
    true = WheelGeometry(0.2 * 1.012, 0.2 * 0.994, 0.4 * 1.02)
    squares = find_squares(*driven(true, NOMINAL, 1), NOMINAL)
    assert [square.is_clockwise for square in squares] == [False, True]
    found = umbmark(squares, NOMINAL)
    assert found.e_d == pytest.approx(0.994 / 1.012, rel=3e-4)
    assert found.e_max_m[1] < 0.01 * found.e_max_m[0]
    again = umbmark(find_squares(*driven(true, found.corrected, 2), found.corrected), found.corrected)
    assert again.e_max_m[0] < 0.1 * found.e_max_m[0]


def test_a_drive_without_squares_has_none_and_a_reference_without_yaw_is_refused():
    stamps_ns, angles_rad = TICK_NS * np.arange(200), np.column_stack([np.linspace(0.0, 100.0, 200)] * 2)
    drive, poses = Drive(stamps_ns, angles_rad), np.zeros((200, 3))
    assert find_squares(drive, Reference('truth', stamps_ns, poses), NOMINAL) == []
    with pytest.raises(ConfigError, match='given 0 clockwise and 0 counter-clockwise'):
        umbmark([], NOMINAL)
    poses[:, 2] = math.nan
    with pytest.raises(ConfigError, match='camera: given positions without yaw; allowed for UMBmark: poses, or --ends'):
        find_squares(drive, Reference('camera', stamps_ns, poses), NOMINAL)


def test_ends_are_read_from_a_table(tmp_path):
    path = tmp_path / 'ends.csv'
    path.write_text('direction, x, y\ncw, 0.1, -0.2\nccw,0.3,0.4\n\ncw 0.5 0.6\n')
    clockwise_m, counter_m = read_ends(path)
    assert clockwise_m.tolist() == [[0.1, -0.2], [0.5, 0.6]]
    assert counter_m.tolist() == [[0.3, 0.4]]

    with pytest.raises(ConfigError, match='none.csv: cannot be read'):
        read_ends(tmp_path / 'none.csv')


@pytest.mark.parametrize('line', ['left, 0.1, 0.2', 'cw, 0.1', 'cw, 0.1, nan', 'ccw, 1, 2, 3'])
def test_a_bad_line_of_ends_is_named(tmp_path, line):
    path = tmp_path / 'ends.csv'
    path.write_text(f'cw, 0, 0\n{line}\n')
    with pytest.raises(ConfigError) as error:
        read_ends(path)
    assert str(error.value) == f'{path}: line 2: given {line}; allowed: cw or ccw, x, y in metres'
