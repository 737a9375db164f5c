"""teleop.launch with a publisher that does as teleop_twist_keyboard does: the robot drives while commands come."""

import re

import pytest

from launched_graph import ROOT, Graph, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(120)]


@pytest.fixture(scope='module')
def graph(tmp_path_factory):
    require_ros()
    with Graph(tmp_path_factory.mktemp('teleop')) as graph:
        launch = graph.launch(ROOT / 'launch' / 'teleop.launch', 'ppr:=1024')
        graph.wait_for_clock(0.5)
        yield graph
        launch.send_signal(2)
        launch.wait(30.0)


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
