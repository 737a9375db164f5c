"""Calling a service with a time limit, which rospy's calls do not have."""

from __future__ import annotations

import concurrent.futures
import threading
from typing import Any

import rospy

LIMIT_S = 5.0
MAP_LIMIT_S = 30.0  # of services that respond with a map


def call_service(service: str, service_class: Any, *request: Any, limit_s: float = LIMIT_S) -> Any:
    """Call a service and return its response.

    A suspended node takes a call and never responds: so the call is made in a thread, which is left behind.

    Raises:
        rospy.ServiceException: there is no such service, it failed, or did not respond within `limit_s` of wall time.
    """
    response: concurrent.futures.Future[Any] = concurrent.futures.Future()

    def call() -> None:
        try:
            response.set_result(rospy.ServiceProxy(service, service_class)(*request))
        except Exception as error:
            response.set_exception(error)

    threading.Thread(target=call, daemon=True).start()
    try:
        return response.result(limit_s)
    except concurrent.futures.TimeoutError:
        raise rospy.ServiceException(f'no response within {limit_s:g} s') from None
