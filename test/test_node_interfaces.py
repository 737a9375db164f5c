"""docs/nodes.yaml, the source of the tables of nodes; the live tests compare it with running nodes."""

import re

import node_interfaces
from diff_encoder_sim.drives.topics import LIVE_TOPICS
from node_interfaces import NODES, declared
from places import ROOT


def test_every_node_is_compared_while_it_runs():
    graphs = node_interfaces.NAVIGATED, node_interfaces.MAPPING, node_interfaces.REPLAY, node_interfaces.FUSED
    assert set(NODES) == set().union(*graphs)


def test_the_nodes_that_record_a_topic_publish_it():
    for topic in LIVE_TOPICS:
        for name in (node.lstrip('/') for node in topic.nodes):
            if name != 'robot_state_publisher':
                assert declared(name, 'publishes').get(topic.name) == topic.message_type.replace('/msg/', '/'), topic


def test_the_parameters_are_those_that_the_node_reads():
    """A node reads its parameters by `node_params(CLASS, ...)`, in the module of its executable."""
    for name, node in NODES.items():
        script = ROOT / 'scripts' / node.get('executable', name)
        called = re.search(r"'ros\.(\w+)[:'\w]*", script.read_text()) if script.exists() else None
        module = ROOT / 'src' / 'diff_encoder_sim' / 'ros' / f'{called[1] if called else name}.py'
        read = re.findall(r'node_params\((\w+)', module.read_text()) if module.exists() else []
        assert 'params' not in node or node['params'].rpartition('.')[2] in read, name
