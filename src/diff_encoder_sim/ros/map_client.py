"""Requesting the map from the service static_map, as upstream's nodes do."""

from __future__ import annotations

import threading
import time
from typing import Callable

import rospy
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap

from diff_encoder_sim.ros.node import log
from diff_encoder_sim.ros.service_call import MAP_LIMIT_S, call_service

WARN_AFTER_S = 5.0
BETWEEN_REQUESTS_S = 1.0


def fetch_map(use_map: Callable[[OccupancyGridMessage], None]) -> None:
    """Call `use_map` once with the map, from a thread, as soon as a node serves it."""
    threading.Thread(target=_fetch, args=(use_map,), daemon=True).start()


def _fetch(use_map: Callable[[OccupancyGridMessage], None]) -> None:
    while not rospy.is_shutdown():
        try:
            rospy.wait_for_service('static_map', timeout=WARN_AFTER_S)
            message = call_service('static_map', GetMap, limit_s=MAP_LIMIT_S).map
        except (rospy.ROSException, rospy.ServiceException) as error:
            if not rospy.is_shutdown():
                log.warning('no map yet: %s; waiting for it', error)
                time.sleep(BETWEEN_REQUESTS_S)  # a server that has no map responds at once
            continue
        use_map(message)
        return
