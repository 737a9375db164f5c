"""Topics that are not connected yet, and nodes that do not respond, from what the master and the nodes report."""

import socket
import threading
from types import SimpleNamespace
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from diff_encoder_sim.ros import graph
from diff_encoder_sim.ros.graph import NodeWatch

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
    monkeypatch.setattr(graph.rosgraph, 'Master', lambda _: master)

    def unconnected(links, topics, if_published=()):
        monkeypatch.setattr(graph, '_links_of', lambda node, _: links[node])
        return graph.unconnected(topics, if_published)

    return unconnected


def test_a_topic_is_connected_when_each_subscriber_is_to_each_publisher(unconnected):
    assert unconnected(ALL, ['/odom', '/tf', '/scan']) == []
    assert unconnected({**ALL, '/amcl': set()}, ['/odom', '/tf']) == ['/tf']
    assert unconnected({**ALL, '/odometry': {('/odom', '/move_base')}}, ['/odom']) == ['/odom']


def test_a_topic_needs_a_publisher_unless_it_may_be_absent(unconnected):
    assert unconnected(ALL, ['/cmd_vel']) == ['/cmd_vel']
    assert unconnected(ALL, [], ['/cmd_vel', '/odom']) == []


@pytest.fixture(name='watch')
def fixture_watch(monkeypatch):
    """Watches the publishers of topics: one responds, one takes the connection and never does, one has died."""
    server = SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False)
    server.register_function(lambda caller: [1, '', 4711], 'getPid')
    threading.Thread(target=server.serve_forever, daemon=True).start()
    suspended = socket.create_server(('127.0.0.1', 0))
    ports = {'/odometry': server.server_address[1], '/amcl': suspended.getsockname()[1], '/rviz': 1}

    def look_up(node):
        if node not in ports:
            raise graph.rosgraph.MasterException('unknown node')
        return f'http://127.0.0.1:{ports[node]}/'

    publishers = [['/odom', ['/odometry', '/test']], ['/tf', ['/odometry', '/amcl']], ['/goal', ['/rviz']]]
    master = SimpleNamespace(getSystemState=lambda: (publishers, [], []), lookupNode=look_up)
    monkeypatch.setattr(graph.rosgraph, 'Master', lambda _: master)
    monkeypatch.setattr(graph.rospy, 'get_name', lambda: '/test')

    def watch(*topics):
        watched = NodeWatch(0.3)
        watched.start(topics, ['/record_trial'])
        watched.check()
        return watched.failure

    yield watch
    suspended.close()
    server.shutdown()
    server.server_close()


def test_a_node_that_does_not_respond_is_named_and_one_that_has_died_is_not(watch):
    assert watch('/odom', '/goal') is None
    assert watch('/odom', '/tf') == 'no response from /amcl for 0.3 s'
