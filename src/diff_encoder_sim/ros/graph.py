"""Connections of nodes: a trial starts when every subscriber is connected to its publishers."""

from __future__ import annotations

import time
from typing import Iterable, List, Set, Tuple

import rosgraph
import rospy

POLL_PERIOD_S = 0.1


def unconnected(topics: Iterable[str], if_published: Iterable[str] = ()) -> List[str]:
    """Return the topics with an unconnected subscriber, and those of `topics` without a publisher."""
    master = rosgraph.Master(rospy.get_name())
    publishers, subscribers = map(dict, master.getSystemState()[:2])
    wanted = [*topics, *(topic for topic in if_published if topic in publishers)]
    nodes = {node for topic in wanted for node in publishers.get(topic, [])}
    links = {node: _links_of(master.lookupNode(node)) for node in nodes}

    def is_connected(topic: str) -> bool:
        pairs = {(topic, subscriber) for subscriber in subscribers.get(topic, [])}
        return topic in publishers and all(pairs <= links[node] for node in publishers[topic])

    return [topic for topic in wanted if not is_connected(topic)]


def _links_of(node_uri: str) -> Set[Tuple[str, str]]:
    """Return (topic, subscribing node) of each connection of a node's publishers."""
    # [code, text, connections of id, destination, direction, transport, topic, connected, ...]
    connections = rospy.core.xmlrpcapi(node_uri).getBusInfo(rospy.get_name())[2]
    return {(connection[4], connection[1]) for connection in connections if connection[2] == 'o' and connection[5]}


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
