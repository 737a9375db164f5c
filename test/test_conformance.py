"""The conformance suite on a ROS graph: this package's nodes, and nodes that cannot be judged."""

import sys
from xml.etree import ElementTree

import pytest
import yaml

from launched_graph import ROOT, Graph, messages_of, require_ros, wait_until

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

NODE, BROKEN = ROOT / 'scripts' / 'conformance_node', ROOT / 'test' / 'support' / 'broken_odometry_node.py'
INPUT = {'/encoder_pulse.pulses[0]': 'left_count', '/encoder_pulse.pulses[1]': 'right_count'}


@pytest.fixture(scope='module')
def graph(tmp_path_factory):
    require_ros()
    with Graph(tmp_path_factory.mktemp('graph')) as graph:
        graph.start_master()
        wait_until(lambda: graph.master.getSystemState()[0], None)
        yield graph


def state_of(graph):
    """Topics, services and nodes; and parameters."""
    publishers, subscribers, services = graph.master.getSystemState()
    return sorted(publishers), sorted(subscribers), sorted(services), sorted(graph.master.getParamNames())


def judged(graph, folder, *arguments):
    """(exit code, output, {clause: failure text, or None}, graph before and after)."""
    before = state_of(graph)
    code, output = graph.run(sys.executable, NODE, '--out', folder, *arguments)
    file = folder / 'conformance.xml'
    cases = ElementTree.parse(str(file)).getroot().iter('testcase') if file.exists() else []
    failures = {case.get('name'): case.find('failure') for case in cases}
    failed = {name.split()[0]: failure.get('message') for name, failure in failures.items() if failure is not None}
    return code, output, failed, (before, state_of(graph))


@pytest.mark.parametrize(
    ('fault', 'clause', 'text'),
    [
        ('silent', '1.1', '/odom: no message within 2 s'),
        ('ending', '1.1', 'ended with status 3'),
        ('string', '1.1', 'std_msgs/String'),
        ('dying', '1.2', 'ended with status -9'),
        pytest.param('flooding', '6.7', 'Hz', marks=pytest.mark.long),
        ('hung', '1.2', 'no odometry'),
    ],
)
def test_a_node_that_cannot_be_judged_fails_a_clause_with_one_line(graph, tmp_path, fault, clause, text):
    about = {'command': f'{sys.executable} {BROKEN} {fault}', 'input': INPUT, 'start_timeout': 2.0}
    mapping = tmp_path / 'node.yaml'
    mapping.write_text(yaml.safe_dump(about))
    code, output, failed, (before, after) = judged(graph, tmp_path, '--node', mapping)
    assert code == 1 and text in failed[clause], output
    assert after == before
    assert 'Traceback' not in output
    if clause == '6.7':
        assert {'/odom', '/encoder_pulse'} <= {*messages_of(tmp_path / f'{clause}.bag')}


@pytest.mark.long
def test_a_node_that_is_running_is_judged_and_left_running(graph, tmp_path):
    launch = graph.launch(ROOT / 'launch' / 'encoder_odometry.launch', 'ppr:=1024')
    wait_until(lambda: {'/odom', '/encoder_pulse'} <= {*dict(graph.master.getSystemState()[0])}, launch)
    code, output, failed, (before, after) = judged(graph, tmp_path, '--start', 'false', '--ppr', '1024')
    assert (code, failed) == (0, {}), output
    assert '4 not applicable' in output  # a first count, wraps, and the covariance, whose noise is not given
    assert after == before and not launch.has_ended()
    # Another robot's nodes must not be disturbed.
    code, output, _, _ = judged(graph, tmp_path)
    assert code == 1 and '/odom: published by /gz_diff_odom_node' in output
    launch.end()


def test_ctrl_c_leaves_no_process(graph, tmp_path):
    suite = graph.start(sys.executable, NODE, '--out', tmp_path)
    wait_until(lambda: '/odom' in dict(graph.master.getSystemState()[0]), suite)
    suite.end()
    wait_until(lambda: '/odom' not in dict(graph.master.getSystemState()[0]), suite)
    assert 'Traceback' not in suite.output()
