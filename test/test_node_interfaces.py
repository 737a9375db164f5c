"""docs/nodes.yaml, the source of the tables of nodes, says what running nodes subscribe to, publish and serve."""

import importlib
import itertools
import re
import sys
import time
from pathlib import Path

import pytest
import yaml

from diff_encoder_sim.base.params import for_xml_rpc, from_xml_rpc, keys_of
from diff_encoder_sim.drives.topics import LIVE_TOPICS
from launched_graph import DATA, ROOT, Graph, require_ros
from reencoding_drives import drive, write_ros1

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

NODES = yaml.safe_load((ROOT / 'docs' / 'nodes.yaml').read_text())
KINDS = ('publishes', 'subscribes', 'services')
OF_EVERY_NODE = {
    'publishes': {'/rosout'},
    'subscribes': {'/clock'},
    'services': {'~get_loggers', '~set_logger_level', '~tf2_frames'},
}
# In each namespace that dynamic_reconfigure changes.
OF_RECONFIGURE = {
    'publishes': {
        'parameter_descriptions': 'dynamic_reconfigure/ConfigDescription',
        'parameter_updates': 'dynamic_reconfigure/Config',
    },
    'services': {'set_parameters': 'dynamic_reconfigure/Reconfigure'},
}
PATIENCE_S = 60.0
LAUNCH = ROOT / 'launch'

WAIT = 'until rosparam get /trial > /dev/null 2>&1; do sleep 0.2; done'
VIEW = f'{WAIT}; exec {sys.executable} {ROOT}/scripts/trial_view_node'


def declared(name, kind):
    """{topic or service: its type}, in full."""
    entries = NODES[name].get(kind, {})
    if entries == 'recorded':
        return {topic.name: topic.message_type.replace('/msg/', '/') for topic in LIVE_TOPICS}
    declared_types = {full(name, entry): type_and_meaning[0] for entry, type_and_meaning in entries.items()}
    for namespace in NODES[name].get('reconfigures', ()):
        for entry, its_type in OF_RECONFIGURE.get(kind, {}).items():
            declared_types[full(name, '~' if namespace == '~' else f'{namespace}/') + entry] = its_type
    return declared_types


def full(name, entry):
    return entry.replace('~', f'/{name}/')


def common(name, kind):
    return {full(name, entry) for entry in OF_EVERY_NODE[kind]}


class Registered:
    """What nodes have registered with a master."""

    def __init__(self, uri):
        import rosgraph

        self._master = rosgraph.Master('/test_node_interfaces', uri)

    def state(self):
        """{(node, kind): names}, {topic: type}"""
        found = {}
        for kind, entries in zip(KINDS, self._master.getSystemState()):
            for entry, nodes in entries:
                for node in nodes:
                    found.setdefault((node.lstrip('/'), kind), set()).add(entry)
        return found, dict(self._master.getTopicTypes())

    def private_parameters(self, node):
        return self._master.getParam(f'/{node}')

    def differences(self, names):
        """Where the declaration and what is registered differ."""
        found, types = self.state()
        problems = []
        for name, kind in itertools.product(names, KINDS):
            there = found.get((name, kind), set()) - common(name, kind)
            known = declared(name, kind)
            known = {entry: its_type for entry, its_type in known.items() if entry not in common(name, kind)}
            optional = {full(name, entry) for entry in NODES[name].get('sometimes', ())}
            problems += [f'{name} {kind} {entry}: not declared' for entry in there - set(known)]
            problems += [f'{name} {kind} {entry}: not there' for entry in set(known) - optional - there]
            if kind != 'services':
                wrong = [entry for entry in there & set(known) if types.get(entry, '*') not in ('*', known[entry])]
                problems += [f'{name} {kind} {entry}: of type {types[entry]}' for entry in wrong]
        return problems


def check(graph, launch, names):
    """Wait until every node has registered all that is declared, and nothing else."""
    registered, deadline = Registered(graph.environment['ROS_MASTER_URI']), time.monotonic() + PATIENCE_S
    problems = ['no master']
    while problems and time.monotonic() < deadline:
        time.sleep(0.5)
        try:
            problems = registered.differences(names)
        except OSError:
            continue
    assert problems == [], launch.output()
    for name in names:
        if 'params' in NODES[name]:
            check_parameters(NODES[name]['params'], registered.private_parameters(name))


def check_parameters(path, private):
    """All values that a node uses are private parameters of it: `rosparam get` shows none that is not in use."""
    module, _, class_name = path.rpartition('.')
    params_class = getattr(importlib.import_module(module), class_name)
    own = {key: value for key, value in private.items() if key in keys_of(params_class)}
    assert own == for_xml_rpc(params_class.from_mapping(from_xml_rpc(own), path).values_in_use())


def test_the_nodes_of_a_navigated_trial(tmp_path):
    require_ros()
    names = (
        *('simulator_node', 'gz_diff_encoder_node', 'gz_diff_odom_node', 'world_pose_node', 'global_pose_node'),
        *('map_server', 'amcl', 'move_base', 'navigation_trial_node', 'record_trial', 'trial_view_node'),
    )
    with Graph(tmp_path) as graph:
        launch = graph.launch(
            LAUNCH / 'trial.launch', f'test:={DATA}/short_route.yaml', 'rtf:=0.1', f'bag:={tmp_path}/a.bag'
        )
        graph.start('sh', '-c', VIEW)
        check(graph, launch, names)


def test_the_nodes_of_mapping(tmp_path):
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(
            LAUNCH / 'mapping.launch', f'tour:={DATA}/short_tour.yaml', 'rtf:=0.1', f'out:={tmp_path}/map'
        )
        check(graph, launch, ('ideal_odom_node', 'scripted_drive_node', 'slam_gmapping', 'simulator_node'))


def test_the_nodes_of_a_replay(tmp_path):
    require_ros()
    bag = write_ros1(tmp_path / 'a.bag', drive())
    with Graph(tmp_path) as graph:
        launch = graph.launch(LAUNCH / 'replay.launch', f'bag:={bag}', 'speed:=0.1')
        check(graph, launch, ('replay_node', 'gz_diff_encoder_node', 'gz_diff_odom_node'))


def test_every_node_is_looked_at():
    looked_at = re.findall(r"'(\w+)'", Path(__file__).read_text())
    assert set(NODES) - set(looked_at) == set()


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
