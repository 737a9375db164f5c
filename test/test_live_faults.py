"""What other nodes do to a live trial: suspended nodes fail it soon, and stamps that cannot be do not."""

import os
import signal
import time

import pytest

from launched_graph import DATA, Graph, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

IMPATIENT = DATA / 'impatient_trial.launch'
# roslaunch gives a process 15 s to answer SIGINT, which one that is suspended never does.
SOON_KILLED = ('--sigint-timeout=1', '--sigterm-timeout=1')
SCRIPTED = ('nav:=scripted', 'test:=SL')
NAVIGATED = ('test:=%s' % (DATA / 'bend.yaml'),)


def wait_for_text(launch, text, limit_s):
    deadline = time.monotonic() + limit_s
    while text not in launch.output():
        assert time.monotonic() < deadline, launch.output()
        time.sleep(0.05)


@pytest.mark.parametrize(
    ('node', 'arguments', 'reason'),
    [('simulator_node', SCRIPTED, 'no /world_pose for 4 s'), ('amcl', NAVIGATED, 'no response from /amcl for 4 s')],
)
def test_a_suspended_node_fails_the_trial_by_its_stall_time(tmp_path, node, arguments, reason):
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(IMPATIENT, *SOON_KILLED, *arguments, 'ppr:=90', f'bag:={tmp_path / "trial.bag"}')
        graph.wait_for_clock(0.5)
        os.kill(launch.pid_of(node), signal.SIGSTOP)
        wait_for_text(launch, f'trial failed: {reason}', 20.0)
        assert launch.wait(40.0) != 0
        assert graph.is_gone(10.0), 'it left processes behind'


def test_no_trial_succeeds_whose_bag_is_not_written_any_more(tmp_path):
    """At rtf:=0 the trial is over before its stall time is."""
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(IMPATIENT, *SOON_KILLED, *SCRIPTED, 'rtf:=0', f'bag:={tmp_path / "trial.bag"}')
        wait_for_text(launch, 'process[record_trial', 60.0)
        graph.wait_for_clock(0.01)
        os.kill(launch.pid_of('record_trial'), signal.SIGSTOP)
        assert launch.wait(60.0) != 0
        assert 'trial failed: no response from /record_trial for 4 s' in launch.output()
