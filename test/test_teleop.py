"""teleop.launch with a publisher that does as teleop_twist_keyboard does: the robot drives while commands come."""

import re

import pytest

from documented_commands import fences
from launched_graph import ROOT, Graph, complaints, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(120)]

SIMULATED_S = 20.0
RECIPES = [
    fence for fence in fences((ROOT / 'docs' / 'live_trials.md').read_text().splitlines()) if fence.language == 'xml'
]


@pytest.fixture(scope='module')
def teleop(tmp_path_factory):
    """(graph, launch)"""
    require_ros()
    with Graph(tmp_path_factory.mktemp('teleop')) as graph:
        launch = graph.launch(ROOT / 'launch' / 'teleop.launch', 'ppr:=1024')
        graph.wait_for_clock(0.5)
        yield graph, launch
        launch.send_signal(2)
        launch.wait(30.0)


@pytest.fixture
def graph(teleop):
    return teleop[0]


def last_x_m(graph):
    code, output = graph.run('rostopic', 'echo', '-n', '1', '/odom/pose/pose/position/x')
    assert code == 0, output
    return float(re.search(r'^-?[\d.e-]+', output, re.MULTILINE)[0])


def test_the_robot_drives_while_commands_come_and_stops_when_they_do_not(graph):
    """It never ends, but for the test's time limit, where the robot does not drive or does not stop."""
    keys = graph.start('rostopic', 'pub', '-r', '10', '/cmd_vel', 'geometry_msgs/Twist', '{linear: {x: 0.3}}')
    while last_x_m(graph) < 0.1:
        pass
    keys.send_signal(2)
    keys.wait()
    while last_x_m(graph) != last_x_m(graph):
        pass


def test_it_runs_without_a_warning(teleop):
    graph, launch = teleop
    graph.wait_for_clock(SIMULATED_S)
    assert complaints(launch.output()) == []


def test_the_documented_launch_file_runs_without_a_warning(tmp_path):
    require_ros()
    (recipe,) = RECIPES
    text = '\n'.join(recipe.lines)
    (tmp_path / 'own.launch').write_text(text)
    with Graph(tmp_path / 'ros') as graph:
        launch = graph.launch(tmp_path / 'own.launch')
        graph.wait_for_clock(SIMULATED_S)
        assert complaints(launch.output()) == []
        assert 'world_pose_node' in launch.output()
        launch.send_signal(2)
        launch.wait(30.0)
