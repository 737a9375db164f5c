"""How a launch of a trial ends: it fails, with a reason, leaves no process, and its bag is not taken for a trial's."""

import json
import os
import signal
import sys

import pytest

from launched_graph import DATA, ROOT, Graph, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

TRIAL, IMPATIENT = ROOT / 'launch' / 'trial.launch', DATA / 'impatient_trial.launch'


class Run:
    """A trial that is on its way; in real time it would take a minute."""

    def __init__(self, folder, launch_file=TRIAL):
        require_ros()
        self.bag = folder / 'trial.bag'
        self.graph = Graph(folder)
        self.launch = self.graph.launch(launch_file, 'nav:=scripted', 'test:=SL', 'ppr:=40', f'bag:={self.bag}')

    def __enter__(self):
        try:
            self.graph.wait_for_clock(0.5)
        except BaseException:
            self.graph.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.graph.__exit__()

    def check_failed(self):
        assert self.launch.wait() == -signal.SIGINT, self.launch.output()  # 130 in a shell, which prints nothing
        assert self.graph.is_gone(), 'it left processes behind'

    def recorded(self):
        """{topic: texts or None} of the bag."""
        from rosbags.highlevel import AnyReader

        texts = {}
        with AnyReader([self.bag]) as reader:
            for connection, _, raw in reader.messages():
                is_text = connection.msgtype == 'std_msgs/msg/String'
                texts[connection.topic] = reader.deserialize(raw, connection.msgtype).data if is_text else None
        return texts


def test_a_killed_node(tmp_path):
    with Run(tmp_path) as run:
        os.kill(run.launch.pid_of('gz_diff_odom_node'), signal.SIGKILL)
        run.check_failed()
        if run.bag.exists():
            assert '/trial_result' not in run.recorded()


def test_ctrl_c_leaves_a_bag_that_analyze_calls_torn(tmp_path):
    with Run(tmp_path) as run:
        run.launch.send_signal(signal.SIGINT)
        run.check_failed()
        assert '/joint_states' in run.recorded() and '/trial_result' not in run.recorded()
        code, output = run.graph.run(sys.executable, ROOT / 'scripts' / 'analyze', run.bag)
        assert code == 0 and 'torn' in output and 'succeeded' not in output, output


def test_time_that_stands_still(tmp_path):
    with Run(tmp_path, IMPATIENT) as run:
        code, output = run.graph.run('rosservice', 'call', '/gazebo/pause_physics')
        assert code == 0, output
        run.check_failed()
        assert 'trial failed: no /world_pose for 4 s' in run.launch.output()
        result = json.loads(run.recorded()['/trial_result'])
        assert result['outcome'] == 'failed' and '/world_pose' in result['reason']
