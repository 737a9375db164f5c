"""Connections and health of nodes: a trial starts when every subscriber is connected to its publishers."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import time
import xmlrpc.client
from http.client import HTTPConnection, HTTPException
from typing import Any, Dict, Iterable, List, Optional, Sequence, Set, Tuple
from xmlrpc.client import ServerProxy, Transport

import rosgraph
import roslib.packages
import rospkg
import rospy

from diff_encoder_sim.base.errors import ConfigError

POLL_PERIOD_S = 0.1
NODE_LIMIT_S = 5.0  # wall time for the response of a node


def unconnected(topics: Iterable[str], if_published: Iterable[str] = ()) -> List[str]:
    """Return the topics without a publisher, or with an unconnected subscriber.

    Topics of `if_published` need no publisher.
    """
    master = rosgraph.Master(rospy.get_name())
    publishers, subscribers, _ = master.getSystemState()
    publishers_of, subscribers_of = dict(publishers), dict(subscribers)
    links: Dict[str, Set[Tuple[str, str]]] = {}
    missing = []
    for topic in (*topics, *(topic for topic in if_published if topic in publishers_of)):
        for node in publishers_of.get(topic, []):
            if node not in links:
                links[node] = _links_of(node, master.lookupNode(node))
        subscribed = set(subscribers_of.get(topic, []))
        connected = [
            {subscriber for link_topic, subscriber in links[node] if link_topic == topic}
            for node in publishers_of.get(topic, [])
        ]
        if not connected or any(subscribed - nodes for nodes in connected):
            missing.append(topic)
    return missing


def wait_until_connected(topics: Iterable[str], if_published: Iterable[str], timeout_s: float) -> List[str]:
    """Wait until no topic is `unconnected`; return the unconnected topics at the timeout (wall time)."""
    deadline_s = time.monotonic() + timeout_s
    while True:
        try:
            missing = unconnected(topics, if_published)
        except (OSError, rosgraph.MasterException) as error:  # a node that is starting or ending
            missing = [str(error)]
        if not missing or time.monotonic() > deadline_s or rospy.is_shutdown():
            return missing
        time.sleep(POLL_PERIOD_S)


def _links_of(node: str, node_uri: str) -> Set[Tuple[str, str]]:
    """Return (topic, subscribing node) of each connection of a node's publishers."""
    try:
        # XML-RPC has no types: [code, text, list of connections].
        response: Any = _node_api(node_uri, NODE_LIMIT_S).getBusInfo(rospy.get_name())
    except OSError as error:
        raise OSError(f'{node}: {error}') from None
    # id, destination, direction, transport, topic, connected, ...
    return {(connection[4], connection[1]) for connection in response[2] if connection[2] == 'o' and connection[5]}


def _node_api(node_uri: str, limit_s: float) -> ServerProxy:
    """Return the XML-RPC interface of a node; calls raise socket.timeout after `limit_s`."""
    transport = Transport()
    make_connection = transport.make_connection

    def make_limited_connection(host: Any) -> HTTPConnection:
        connection = make_connection(host)
        connection.timeout = limit_s
        return connection

    transport.make_connection = make_limited_connection  # type: ignore[method-assign]
    return ServerProxy(node_uri, transport=transport)


class NodeWatch:
    """Polls the process id of nodes; a node fails if it does not respond within a limit.

    A node that has died is not reported here, but by roslaunch.
    """

    def __init__(self, limit_s: float) -> None:
        """Set the limit `limit_s` in wall time."""
        self._limit_s = limit_s
        self._uris: Dict[str, str] = {}
        self.failure: Optional[str] = None  # the node that does not respond

    def start(self, topics: Iterable[str], other_nodes: Iterable[str] = ()) -> None:
        """Watch the nodes that publish these topics now, and others if they run, from a thread."""
        master = rosgraph.Master(rospy.get_name())
        publishers = dict(master.getSystemState()[0])
        nodes = {node for topic in topics for node in publishers.get(topic, [])} - {rospy.get_name()}
        for node in sorted(nodes.union(other_nodes)):
            with contextlib.suppress(rosgraph.MasterException):
                self._uris[node] = master.lookupNode(node)
        threading.Thread(target=self._watch, daemon=True).start()

    def check(self) -> None:
        """Request once from every node; sets `failure` if one does not respond."""
        for node, uri in self._uris.items():
            try:
                _node_api(uri, self._limit_s).getPid(rospy.get_name())
            except socket.timeout:
                self.failure = f'no response from {node} for {self._limit_s:g} s'
                return
            except (OSError, HTTPException, xmlrpc.client.Error):
                continue  # it has died

    def _watch(self) -> None:
        while not rospy.is_shutdown() and self.failure is None:
            self.check()
            time.sleep(self._limit_s / 10)


def become(package: str, executable: str, arguments: Sequence[str], install_hint: str) -> None:
    """Replace this process by another package's executable, so that signals reach it directly.

    Raises:
        ConfigError: it is not installed; the message contains `install_hint`.
    """
    try:
        found = roslib.packages.find_node(package, executable)
    except rospkg.ResourceNotFound:
        found = []
    if not found:
        raise ConfigError(f'{package} {executable} is not installed; {install_hint}')
    remappings = [argument for argument in sys.argv[1:] if ':=' in argument]
    os.execv(found[0], [found[0], *arguments, *remappings])
