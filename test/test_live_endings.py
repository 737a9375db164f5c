"""How a launch of a trial ends: it fails, with a reason, leaves no process, and its bag is not taken for a trial's."""

import contextlib
import json
import os
import signal
import sys

import pytest

from launched_graph import DATA, ROOT, Graph, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

TRIAL, IMPATIENT = ROOT / 'launch' / 'trial.launch', DATA / 'impatient_trial.launch'


@contextlib.contextmanager
def run(folder, launch_file=TRIAL):
    """(graph, launch, bag) of a trial that is on its way; in real time it would take a minute."""
    require_ros()
    bag = folder / 'trial.bag'
    with Graph(folder) as graph:
        launch = graph.launch(launch_file, 'nav:=scripted', 'test:=SL', 'ppr:=40', f'bag:={bag}')
        graph.wait_for_clock(0.5)
        yield graph, launch, bag


def check_failed(graph, launch):
    assert launch.wait() == -signal.SIGINT, launch.output()  # 130 in a shell, which prints nothing
    assert graph.is_gone(), 'it left processes behind'


def recorded(bag):
    """{topic: texts or None} of the bag."""
    from rosbags.highlevel import AnyReader

    texts = {}
    with AnyReader([bag]) as reader:
        for connection, _, raw in reader.messages():
            is_text = connection.msgtype == 'std_msgs/msg/String'
            texts[connection.topic] = reader.deserialize(raw, connection.msgtype).data if is_text else None
    return texts


def test_a_killed_node(tmp_path):
    with run(tmp_path) as (graph, launch, bag):
        os.kill(launch.pid_of('gz_diff_odom_node'), signal.SIGKILL)
        check_failed(graph, launch)
        if bag.exists():
            assert '/trial_result' not in recorded(bag)


def test_ctrl_c_leaves_a_bag_that_analyze_calls_torn(tmp_path):
    with run(tmp_path) as (graph, launch, bag):
        launch.send_signal(signal.SIGINT)
        check_failed(graph, launch)
        assert '/joint_states' in recorded(bag) and '/trial_result' not in recorded(bag)
        code, output = graph.run(sys.executable, ROOT / 'scripts' / 'analyze', bag)
        assert code == 0 and 'torn' in output and 'succeeded' not in output, output


def test_time_that_stands_still(tmp_path):
    with run(tmp_path, IMPATIENT) as (graph, launch, bag):
        code, output = graph.run('rosservice', 'call', '/gazebo/pause_physics')
        assert code == 0, output
        check_failed(graph, launch)
        assert 'trial failed: no /world_pose for 4 s' in launch.output()
        result = json.loads(recorded(bag)['/trial_result'])
        assert result['outcome'] == 'failed' and '/world_pose' in result['reason']
