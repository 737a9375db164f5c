"""The topics of a trial's bag."""

import re

from diff_encoder_sim.drives.topics import RECORDED, TOPIC_OF_SOURCE, TOPICS, PoseSource
from places import ROOT


def test_every_pose_source_has_a_recorded_topic_of_its_own():
    assert list(TOPIC_OF_SOURCE) == list(PoseSource)
    assert set(TOPIC_OF_SOURCE.values()) < set(RECORDED) and len(set(TOPIC_OF_SOURCE.values())) == len(PoseSource)


def test_the_topics_nodes_are_those_of_the_launch_files():
    launched = set()
    for path in (ROOT / 'launch').glob('*.launch'):
        launched.update(re.findall(r'<node name="(\w+)"', path.read_text()))
    assert {node.lstrip('/') for topic in TOPICS for node in topic.nodes} <= launched
