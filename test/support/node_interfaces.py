"""Compares running nodes with docs/nodes.yaml: topics, services and their types, and parameters in use."""

import importlib
import itertools
import time

import yaml

from diff_encoder_sim.base.params import for_xml_rpc, from_xml_rpc, keys_of
from diff_encoder_sim.drives.topics import LIVE_TOPICS
from places import ROOT

NODES = yaml.safe_load((ROOT / 'docs' / 'nodes.yaml').read_text())
KINDS = ('publishes', 'subscribes', 'services')
OF_EVERY_NODE = {'publishes': {'/rosout'}, 'subscribes': {'/clock'}}
OF_EVERY_NODE['services'] = {'~get_loggers', '~set_logger_level', '~tf2_frames'}
# In each namespace that dynamic_reconfigure changes.
OF_RECONFIGURE = {
    'publishes': {
        'parameter_descriptions': 'dynamic_reconfigure/ConfigDescription',
        'parameter_updates': 'dynamic_reconfigure/Config',
    },
    'services': {'set_parameters': 'dynamic_reconfigure/Reconfigure'},
}
PATIENCE_S = 60.0

# The nodes that each graph of the live tests compares.
NAVIGATED = (
    *('simulator_node', 'gz_diff_encoder_node', 'gz_diff_odom_node', 'world_pose_node', 'global_pose_node'),
    *('map_server', 'amcl', 'move_base', 'navigation_trial_node', 'record_trial', 'trial_view_node'),
)
MAPPING = ('ideal_odom_node', 'scripted_drive_node', 'slam_gmapping', 'simulator_node')
FUSED = ('odometry_fusion_node',)  # the wheels' then has no /tf
REPLAY = ('replay_node', 'gz_diff_encoder_node', 'gz_diff_odom_node')


def declared(name, kind):
    """{topic or service: its type}, in full."""
    entries = NODES[name].get(kind, {})
    if entries == 'recorded':
        return {topic.name: topic.message_type.replace('/msg/', '/') for topic in LIVE_TOPICS}
    types = {full(name, entry): type_and_meaning[0] for entry, type_and_meaning in entries.items()}
    for namespace in NODES[name].get('reconfigures', ()):
        for entry, its_type in OF_RECONFIGURE.get(kind, {}).items():
            types[full(name, '~' if namespace == '~' else f'{namespace}/') + entry] = its_type
    return types


def full(name, entry):
    return entry.replace('~', f'/{name}/')


def check_interfaces(graph, launch, names):
    """Wait until every node has registered all that is declared, and nothing else."""
    deadline, problems = time.monotonic() + PATIENCE_S, ['no master']
    while problems and time.monotonic() < deadline:
        time.sleep(0.1)
        try:
            problems = differences(graph.master, names)
        except OSError:
            continue
    assert problems == [], launch.output()
    for name in names:
        if 'params' in NODES[name]:
            check_parameters(NODES[name]['params'], graph.master.getParam(f'/{name}'))


def differences(master, names):
    """Where the declaration and what is registered with the master differ."""
    types, there = dict(master.getTopicTypes()), {}
    for kind, entries in zip(KINDS, master.getSystemState()):
        for entry, nodes in entries:
            for node in nodes:
                there.setdefault((node.lstrip('/'), kind), set()).add(entry)
    problems = []
    for name, kind in itertools.product(names, KINDS):
        common = {full(name, entry) for entry in OF_EVERY_NODE[kind]}
        found = there.get((name, kind), set()) - common
        known = {entry: its_type for entry, its_type in declared(name, kind).items() if entry not in common}
        optional = {full(name, entry) for entry in NODES[name].get('sometimes', ())}
        problems += [f'{name} {kind} {entry}: not declared' for entry in found - set(known)]
        problems += [f'{name} {kind} {entry}: not there' for entry in set(known) - optional - found]
        if kind != 'services':
            wrong = [entry for entry in found & set(known) if types.get(entry, '*') not in ('*', known[entry])]
            problems += [f'{name} {kind} {entry}: of type {types[entry]}' for entry in wrong]
    return problems


def check_parameters(path, private):
    """All values that a node uses are private parameters of it: `rosparam get` shows none that is not in use."""
    module, _, class_name = path.rpartition('.')
    params_class = getattr(importlib.import_module(module), class_name)
    own = {key: value for key, value in private.items() if key in keys_of(params_class)}
    assert own == for_xml_rpc(params_class.from_mapping(from_xml_rpc(own), path).values_in_use())
