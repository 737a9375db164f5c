"""Services of move_base: plans without driving, for which there are two names, and costmaps that forget obstacles."""

from __future__ import annotations

from typing import Callable, ContextManager, Optional

import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.plan_error import PlanError
from diff_encoder_sim.ros.conversions import ns_from_stamp
from diff_encoder_sim.ros.navigation_transforms import NavigationTransforms
from diff_encoder_sim.ros.navigation_views import path_message
from diff_encoder_sim.ros.node import log


class PlanServices:
    """Serves `~make_plan`, `~NavfnROS/make_plan` and `~clear_costmaps`.

    Args:
        transforms: of poses to the map frame.
        lock: held while the navigator is used.
        navigator: returns it, None while there is no map.
    """

    def __init__(
        self,
        transforms: NavigationTransforms,
        lock: ContextManager[object],
        navigator: Callable[[], Optional[Navigator]],
    ) -> None:
        self._transforms, self._lock, self._navigator = transforms, lock, navigator
        self._services = [
            rospy.Service('~make_plan', GetPlan, self._on_make_plan),
            rospy.Service('~NavfnROS/make_plan', GetPlan, self._on_make_plan),
            rospy.Service('~clear_costmaps', Empty, self._on_clear_costmaps),
        ]

    def _on_make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        with self._lock:
            navigator = self._navigator()
            if navigator is None:
                raise rospy.ServiceException('there is no map yet')
            try:
                poses = self._plan(navigator, request)
            except InputFault as fault:
                raise rospy.ServiceException(str(fault)) from None
            except PlanError as error:
                # As upstream: a valid request for which there is no plan gets an empty one.
                log.warning('make_plan: %s', str(error))
                poses = np.empty((0, 3))
        return GetPlanResponse(plan=path_message(poses, ns_from_stamp(rospy.Time.now()), self._transforms.map_frame))

    def _plan(self, navigator: Navigator, request: GetPlanRequest) -> np.ndarray:
        has_start = bool(request.start.header.frame_id)
        start = self._pose_in_map('start', request.start) if has_start else None
        return navigator.make_plan(start, self._pose_in_map('goal', request.goal), request.tolerance)

    def _pose_in_map(self, what: str, message: PoseStamped) -> Pose2D:
        try:
            return self._transforms.pose_in_map(message)
        except InputFault as fault:
            raise InputFault(f'{what}: {fault}') from None

    def _on_clear_costmaps(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            navigator = self._navigator()
            if navigator is not None:
                navigator.clear_costmaps()
        return EmptyResponse()
