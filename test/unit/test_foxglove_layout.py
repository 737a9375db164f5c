"""The layout for Foxglove shows what our bags hold."""

import json

from diff_encoder_sim.recording.topics import TOPICS
from diff_encoder_sim.serialization.typestore import STORE
from places import CONFIG

LAYOUT = json.loads((CONFIG / 'foxglove' / 'trial.json').read_text())
KINDS = {topic.name: topic.message_type for topic in TOPICS}


def plotted(config):
    yield from (path['value'] for path in config.get('paths', ()))
    if 'xAxisPath' in config:
        yield config['xAxisPath']['value']


def test_every_plotted_field_is_one_of_a_recorded_topic():
    values = [value for config in LAYOUT['configById'].values() for value in plotted(config)]
    assert len(values) > 5
    for value in values:
        topic, *fields = value.split('.')
        kind = KINDS[topic]
        for field in fields:
            known = STORE.types[kind].__dataclass_fields__
            assert field.split('[')[0] in known, value
            kind = str(known[field.split('[')[0]].type).replace('__', '/')


def test_the_scene_shows_recorded_topics():
    assert set(LAYOUT['configById']['3D!scene']['topics']) <= set(KINDS)


def test_every_panel_has_its_place():
    def leaves(node):
        return [node] if isinstance(node, str) else leaves(node['first']) + leaves(node['second'])

    assert sorted(leaves(LAYOUT['layout'])) == sorted(LAYOUT['configById'])
