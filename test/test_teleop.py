"""teleop.launch with a publisher that does as teleop_twist_keyboard does: the robot drives while commands arrive."""

import re
import signal

import pytest

from launched_graph import ROOT, Graph, complaints, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(120)]


def last_x_m(graph):
    code, output = graph.run('rostopic', 'echo', '-n', '1', '/odom/pose/pose/position/x')
    assert code == 0, output
    return float(re.search(r'^-?[\d.e-]+', output, re.MULTILINE)[0])


def test_the_robot_drives_while_commands_arrive_and_then_stops(tmp_path):
    """It does not end before the test's time limit if the robot does not drive or does not stop."""
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(ROOT / 'launch' / 'teleop.launch', 'ppr:=1024')
        graph.wait_for_clock(0.5)
        keys = graph.start('rostopic', 'pub', '-r', '10', '/cmd_vel', 'geometry_msgs/Twist', '{linear: {x: 0.3}}')
        while last_x_m(graph) < 0.1:
            pass
        keys.send_signal(signal.SIGINT)
        keys.wait()
        while last_x_m(graph) != last_x_m(graph):
            pass
        assert complaints(launch.output()) == []
        launch.end()
