"""Noticing nodes that are suspended or hang: they keep their connections, so their topics fall silent unnoticed."""

from __future__ import annotations

import socket
import threading
import time
import xmlrpc.client
from http.client import HTTPException
from typing import Dict, Iterable, Optional

import rosgraph
import rospy

from diff_encoder_sim.ros.graph import node_api

ROUNDS_PER_LIMIT = 10


class NodeWatch:
    """Asks nodes for their process id over and over; one that does not respond within a limit has failed.

    A node that has died is not this one's concern: roslaunch notices that.
    """

    def __init__(self, limit_s: float) -> None:
        """Prepare; `limit_s` is of wall time."""
        self._limit_s = limit_s
        self._uris: Dict[str, str] = {}
        self.failure: Optional[str] = None  # which node does not respond

    def start(self, topics: Iterable[str], other_nodes: Iterable[str] = ()) -> None:
        """Watch the nodes that publish these topics now, and others where they run, from a thread."""
        master = rosgraph.Master(rospy.get_name())
        publishers = dict(master.getSystemState()[0])
        nodes = {node for topic in topics for node in publishers.get(topic, [])} - {rospy.get_name()}
        for node in sorted(nodes.union(other_nodes)):
            try:
                self._uris[node] = master.lookupNode(node)
            except rosgraph.MasterException:
                continue  # it does not run
        threading.Thread(target=self._watch, daemon=True).start()

    def check(self) -> Optional[str]:
        """Ask every node once; returns which one does not respond, None if all do."""
        for node, uri in self._uris.items():
            try:
                node_api(uri, self._limit_s).getPid(rospy.get_name())
            except socket.timeout:
                self.failure = f'no response from {node} for {self._limit_s:g} s'
                break
            except (OSError, HTTPException, xmlrpc.client.Error):
                continue  # it has died
        return self.failure

    def _watch(self) -> None:
        while not (rospy.is_shutdown() or self.check()):
            time.sleep(self._limit_s / ROUNDS_PER_LIMIT)
