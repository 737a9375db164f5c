"""Topics that are not connected yet, from what the master and the nodes report."""

from types import SimpleNamespace

import pytest

from diff_encoder_sim.ros import node

PUBLISHERS = [['/odom', ['/odometry']], ['/scan', ['/simulator']], ['/tf', ['/odometry', '/amcl']]]
SUBSCRIBERS = [['/odom', ['/move_base', '/recorder']], ['/tf', ['/move_base']], ['/cmd_vel', ['/simulator']]]

# The nodes' outbound connections: (topic, subscribing node).
ALL = {
    '/odometry': {('/odom', '/move_base'), ('/odom', '/recorder'), ('/tf', '/move_base')},
    '/amcl': {('/tf', '/move_base')},
    '/simulator': set(),
}


@pytest.fixture(name='unconnected')
def fixture_unconnected(monkeypatch):
    master = SimpleNamespace(getSystemState=lambda: (PUBLISHERS, SUBSCRIBERS, []), lookupNode=lambda name: name)
    monkeypatch.setattr(node.rosgraph, 'Master', lambda _: master)

    def unconnected(links, topics, if_published=()):
        monkeypatch.setattr(node, '_links_of', lambda uri: links[uri])
        return node.unconnected(topics, if_published)

    return unconnected


def test_a_topic_is_connected_when_each_subscriber_is_to_each_publisher(unconnected):
    assert unconnected(ALL, ['/odom', '/tf', '/scan']) == []
    assert unconnected({**ALL, '/amcl': set()}, ['/odom', '/tf']) == ['/tf']
    assert unconnected({**ALL, '/odometry': {('/odom', '/move_base')}}, ['/odom']) == ['/odom']


def test_a_topic_needs_a_publisher_unless_it_may_be_absent(unconnected):
    assert unconnected(ALL, ['/cmd_vel']) == ['/cmd_vel']
    assert unconnected(ALL, [], ['/cmd_vel', '/odom']) == []
