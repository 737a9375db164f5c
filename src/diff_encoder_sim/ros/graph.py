"""Who is connected to whom: a trial starts when every subscriber hears its publishers."""

from __future__ import annotations

import time
from typing import Dict, Iterable, List, Set, Tuple
from xmlrpc.client import ServerProxy

import rosgraph
import rospy

POLL_PERIOD_S = 0.1


def unheard(topics: Iterable[str], if_published: Iterable[str] = ()) -> List[str]:
    """Topics that nobody publishes, or that a registered subscriber is not yet connected to.

    Of `if_published` it does not matter whether somebody publishes them.
    """
    master = rosgraph.Master(rospy.get_name())
    publishers, subscribers, _ = master.getSystemState()
    publishers_of, subscribers_of = dict(publishers), dict(subscribers)
    links: Dict[str, Set[Tuple[str, str]]] = {}
    missing = []
    for topic in (*topics, *(topic for topic in if_published if topic in publishers_of)):
        for node in publishers_of.get(topic, []):
            if node not in links:
                links[node] = _outbound_links(master.lookupNode(node))
        wanted = set(subscribers_of.get(topic, []))
        heard_by = [
            {listener for link_topic, listener in links[node] if link_topic == topic}
            for node in publishers_of.get(topic, [])
        ]
        if not heard_by or any(wanted - listeners for listeners in heard_by):
            missing.append(topic)
    return missing


def wait_until_heard(topics: Iterable[str], if_published: Iterable[str], timeout_s: float) -> List[str]:
    """Wait, by the wall clock, until `unheard` is empty; returns what is left at the timeout."""
    deadline_s = time.monotonic() + timeout_s
    while True:
        try:
            missing = unheard(topics, if_published)
        except (OSError, rosgraph.MasterException) as error:  # a node that is going or coming
            missing = [str(error)]
        if not missing or time.monotonic() > deadline_s or rospy.is_shutdown():
            return missing
        time.sleep(POLL_PERIOD_S)


def _outbound_links(node_uri: str) -> Set[Tuple[str, str]]:
    """(topic, listening node) of each connection that a node's publishers have."""
    code, message, connections = ServerProxy(node_uri).getBusInfo(rospy.get_name())
    if code != 1:
        raise OSError(message)
    # id, destination, direction, transport, topic, connected, ...
    return {(connection[4], connection[1]) for connection in connections if connection[2] == 'o' and connection[5]}
