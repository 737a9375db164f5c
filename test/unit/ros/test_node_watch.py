"""Which nodes do not respond, from a node's own interface that answers, hangs or is gone."""

import socket
import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.ros import graph
from diff_encoder_sim.ros.graph import NodeWatch


@pytest.fixture(name='uris')
def fixture_uris():
    """By node: one that responds, one that takes the connection and never does, and one that has died."""
    server = SimpleXMLRPCServer(('127.0.0.1', 0), logRequests=False)
    server.register_function(lambda caller: [1, '', 4711], 'getPid')
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with socket.create_server(('127.0.0.1', 0)) as suspended, socket.create_server(('127.0.0.1', 0)) as dead:
        dead.close()
        ports = {'/odometry': server.server_address[1], '/amcl': suspended.getsockname()[1], '/rviz': 1}
        yield {node: f'http://127.0.0.1:{port}/' for node, port in ports.items()}
    server.shutdown()
    server.server_close()


@pytest.fixture(name='watch')
def fixture_watch(monkeypatch, uris):
    """Starts a watch of the nodes that publish given topics."""

    class Master:
        def __init__(self, _):
            pass

        def getSystemState(self):
            return [['/odom', ['/odometry', '/test']], ['/tf', ['/odometry', '/amcl']], ['/goal', ['/rviz']]], [], []

        def lookupNode(self, node):
            if node not in uris:
                raise graph.rosgraph.MasterException('unknown node')
            return uris[node]

    monkeypatch.setattr(graph.rosgraph, 'Master', Master)
    monkeypatch.setattr(graph.rospy, 'get_name', lambda: '/test')

    def start(*topics):
        watch = NodeWatch(0.3)
        watch.start(topics, ['/record_trial'])
        return watch

    return start


def test_nodes_that_respond_or_have_died_are_no_failure(watch):
    watched = watch('/odom', '/goal')
    assert watched.check() is None
    assert watched.failure is None


def test_a_node_that_does_not_respond_is_named(watch):
    watched = watch('/odom', '/tf')
    assert watched.check() == 'no response from /amcl for 0.3 s'
    assert watched.failure == 'no response from /amcl for 0.3 s'
