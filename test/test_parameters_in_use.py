"""`rosparam get` of a node's private parameters returns the values in use, for each launch on the same master."""

import time

import pytest
import yaml

from launched_graph import ROOT, Graph, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(200)]

NODES = ('gz_diff_encoder_node', 'gz_diff_odom_node')
PATIENCE_S = 30.0


@pytest.fixture(scope='module')
def graph(tmp_path_factory):
    """A master that outlives the launches."""
    require_ros()
    with Graph(tmp_path_factory.mktemp('parameters')) as graph:
        graph.start('roscore', '-p', str(graph.port))
        while graph.run('rosparam', 'list')[0] != 0:
            pass
        yield graph


def private(graph, node):
    code, output = graph.run('rosparam', 'get', f'/{node}')
    return yaml.safe_load(output) if code == 0 else {}


def wait_for(graph, nodes, key, value):
    deadline = time.monotonic() + PATIENCE_S
    while True:
        found = {node: private(graph, node).get(key) for node in nodes}
        if all(each == value for each in found.values()) or time.monotonic() > deadline:
            assert found == dict.fromkeys(nodes, value)
            return


def end(launch):
    launch.send_signal(2)
    launch.wait(30.0)


# In this order: none finds the value of the one before.
@pytest.mark.parametrize(
    ('arguments', 'ppr'),
    [
        (['ppr:=40'], 40),
        (['ppr:={left: 90, right: 1024}'], {'left': 90, 'right': 1024}),
        (['encoder:=amt102'], 8192),
        (['robot:=burger'], 4096),
    ],
)
def test_the_resolution_is_that_of_the_launch_argument(graph, arguments, ppr):
    launch = graph.launch(ROOT / 'launch' / 'encoder_odometry.launch', *arguments)
    wait_for(graph, NODES, 'ppr', ppr)
    robots = {'base_frame': 'base_footprint' if 'robot:=burger' in arguments else 'base_link'}
    assert {key: private(graph, NODES[1])[key] for key in robots} == robots
    assert private(graph, NODES[0])['encoder']['lines' if 'encoder:=amt102' in arguments else 'noise'] in (2048, 0.0)
    end(launch)


def test_what_is_typed_overrides_and_is_shown(graph):
    encoder = graph.start('rosrun', 'diff_encoder_sim', 'gz_diff_encoder_node', '_ppr:=7', '_rate:=50.0')
    wait_for(graph, NODES[:1], 'ppr', 7)
    wait_for(graph, NODES[:1], 'rate', 50.0)
    end(encoder)


@pytest.mark.parametrize(('name', 'world'), [('SMT', 'ros_logo')])
def test_a_trial_does_not_find_the_world_of_the_one_before(graph, name, world):
    launch = graph.launch(ROOT / 'launch' / 'trial.launch', f'test:={name}', 'nav:=scripted', 'bag:=none', 'ppr:=40')
    wait_for(graph, ['simulator_node'], 'world', str(ROOT / 'worlds' / f'{world}.world'))
    wait_for(graph, NODES, 'ppr', 40)
    end(launch)
