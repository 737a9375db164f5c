"""Topics that are not connected yet, from what the master and the nodes report."""

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.ros import graph

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
    class Master:
        def __init__(self, _):
            pass

        def getSystemState(self):
            return PUBLISHERS, SUBSCRIBERS, []

        def lookupNode(self, name):
            return name

    def unconnected(links, topics, if_published=()):
        monkeypatch.setattr(graph, '_outbound_links', links.__getitem__)
        return graph.unconnected(topics, if_published)

    monkeypatch.setattr(graph.rosgraph, 'Master', Master)
    return unconnected


def test_a_topic_is_connected_when_each_subscriber_is_to_each_publisher(unconnected):
    assert unconnected(ALL, ['/odom', '/tf', '/scan']) == []
    late = {**ALL, '/amcl': set()}
    assert unconnected(late, ['/odom', '/tf']) == ['/tf']
    assert unconnected({**ALL, '/odometry': {('/odom', '/move_base')}}, ['/odom']) == ['/odom']


def test_a_topic_needs_a_publisher_unless_it_may_be_absent(unconnected):
    assert unconnected(ALL, ['/cmd_vel']) == ['/cmd_vel']
    assert unconnected(ALL, [], ['/cmd_vel', '/odom']) == []
