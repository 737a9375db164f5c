"""The layout for Foxglove shows what our bags hold."""

import json

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.drives.topics import TOPICS
from diff_encoder_sim.drives.typestore import message_store, ros2_definition
from places import CONFIG

LAYOUT = json.loads((CONFIG / 'foxglove' / 'trial.json').read_text())
KINDS = {topic.name: topic.message_type for topic in TOPICS}


def ros2_store():
    """The types as MCAP files define them."""
    store = get_typestore(Stores.EMPTY)
    for kind in set(KINDS.values()):
        types = get_types_from_msg(ros2_definition(kind)[0], kind)
        store.register({name: fields for name, fields in types.items() if name not in store.types})
    return store


def plotted(config):
    yield from (path['value'] for path in config.get('paths', ()))
    if 'xAxisPath' in config:
        yield config['xAxisPath']['value']


@pytest.mark.parametrize('store', [message_store(Stores.ROS1_NOETIC), ros2_store()], ids=['ROS 1', 'MCAP'])
def test_every_plotted_field_is_one_of_a_recorded_topic(store):
    values = [value for config in LAYOUT['configById'].values() for value in plotted(config)]
    assert len(values) > 5
    for value in values:
        topic, *fields = value.split('.')
        kind = KINDS[topic]
        for field in fields:
            known = store.types[kind].__dataclass_fields__
            assert field.split('[')[0] in known, value
            kind = str(known[field.split('[')[0]].type).replace('__', '/')


def test_the_scene_shows_recorded_topics_and_every_panel_has_its_place():
    def leaves(node):
        return [node] if isinstance(node, str) else leaves(node['first']) + leaves(node['second'])

    assert set(LAYOUT['configById']['3D!scene']['topics']) <= set(KINDS)
    assert sorted(leaves(LAYOUT['layout'])) == sorted(LAYOUT['configById'])
