"""amcl_node: localization on upstream amcl's topics, services, parameters and transform."""

from __future__ import annotations

import threading
from typing import Any, Dict, Optional

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import SetMap, SetMapRequest, SetMapResponse
from pydantic import Field
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.bounds import PositiveDuration_s, Seed
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.localization.amcl import Amcl, warm_up
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.ros.amcl_output import AmclOutput, InitialPoseReader, PoseGuess
from diff_encoder_sim.ros.conversions import ns_from_stamp, stamp_from_ns
from diff_encoder_sim.ros.encoded_topics import stamped_subscriber
from diff_encoder_sim.ros.maps import fetch_map, grid_from_message
from diff_encoder_sim.ros.node import compile_first, log, node_params, publisher, run_node, subscriber, trial_plan
from diff_encoder_sim.ros.reconfiguration import serve_amcl
from diff_encoder_sim.ros.scan_queue import SCANS_MOST_AHEAD_S, ScanQueue
from diff_encoder_sim.ros.transform_buffer import TransformBuffer

SILENCE_S = 15.0


class AmclNodeParams(AmclParams):
    """Parameters of amcl_node: those of the filter, and of the node alone."""

    seed: Seed = Field(0, description='of all random draws; default: the number of /trial')
    diagnostic_period: PositiveDuration_s = Field(1.0, description='between two messages on /diagnostics [s]')


class AmclNode:
    """Waits for a map, then updates the filter with each scan and the odometry at the scan's time."""

    def __init__(self) -> None:
        params = node_params(AmclNodeParams, part='amcl', defaults=_trial_defaults())
        # Frame ids may begin with '/', as they did before tf2.
        self._params = params.model_copy(
            update={
                name: getattr(params, name).lstrip('/')
                for name in ('odom_frame_id', 'base_frame_id', 'global_frame_id')
            }
        )
        compile_first(lambda: warm_up(self._params))
        self._lock = threading.RLock()  # scans, transforms and services come in threads
        self._amcl: Optional[Amcl] = None
        self._guess: Optional[PoseGuess] = None  # from before there was a map
        self._rng = generator(self._params.seed, 'amcl')
        self._timeline = Timeline(tolerance_ns=NANOSECONDS_PER_SECOND // 10)
        self._buffer = TransformBuffer(cache_s=30.0)
        self._initial_pose = InitialPoseReader(self._params, self._buffer)
        self._undelayed = publisher('/tf', TFMessage)
        # So that the simulator can wait for the answer to each scan; upstream publishes nothing for most of them.
        self._taken = publisher('~scan_taken', Header)
        self._output = AmclOutput(self._params, self._params.diagnostic_period)
        self._queue = ScanQueue(
            rospy.resolve_name('scan'),
            self._buffer,
            self._params.base_frame_id,
            self._params.odom_frame_id,
            self._localize,
        )
        self._subscribe()
        rospy.on_shutdown(self._output.save)
        self._reconfiguration = serve_amcl(self._params, self._reconfigure)

    def _reconfigure(self, params: AmclNodeParams) -> None:
        warm_up(params)  # another model may not be compiled yet; scans do not wait for that
        with self._lock:
            self._params = self._output.params = params
            if self._amcl is not None:
                self._amcl.reconfigure(params)

    def _subscribe(self) -> None:
        self._services = [
            rospy.Service('global_localization', Empty, self._on_global_localization),
            rospy.Service('request_nomotion_update', Empty, self._on_nomotion_update),
            rospy.Service('set_map', SetMap, self._on_set_map),
        ]
        self._initial_poses = subscriber('initialpose', PoseWithCovarianceStamped, self._on_initial_pose)
        self._scans = stamped_subscriber('scan', LaserScan, self._on_scan, SCANS_MOST_AHEAD_S)
        # The laser's transform may come last, after the scan and its odometry.
        self._buffer.listen(self._process)
        self._has_had_scan = False
        self._silence = rospy.Timer(rospy.Duration(SILENCE_S), self._on_silence, reset=True)
        if self._params.use_map_topic:
            self._maps = subscriber('map', OccupancyGridMessage, self._on_map)
        else:
            fetch_map(self._use_first_map)

    # ---- maps

    def _use_first_map(self, message: OccupancyGridMessage) -> None:
        with self._lock:
            if self._amcl is None:  # set_map may have been quicker
                self._try_map(message)

    def _on_map(self, message: OccupancyGridMessage) -> None:
        with self._lock:
            if self._amcl is None or not self._params.first_map_only:
                self._try_map(message)

    def _try_map(self, message: OccupancyGridMessage) -> None:
        try:
            self._use_map(message, self._guess or self._output.saved)
        except InputFault as fault:
            log.warning('map not used: %s', fault)

    def _use_map(self, message: OccupancyGridMessage, guess: Optional[PoseGuess]) -> None:
        """Start localization on a map: at the guess, or without one at the initial_pose_* parameters."""
        grid = grid_from_message(message)
        frame = message.header.frame_id.lstrip('/')
        if frame != self._params.global_frame_id:
            log.warning(
                'map: header.frame_id is %r; used as if it were %r (global_frame_id)',
                frame,
                self._params.global_frame_id,
            )
        with self._lock:
            amcl = self._amcl or Amcl(self._params, grid, self._rng)
            if guess is not None:
                amcl.set_map(grid, *guess)
            elif self._amcl is not None:
                amcl.set_map(grid)
            self._amcl, self._guess = amcl, None
            self._output.restart()

    def _on_set_map(self, request: SetMapRequest) -> SetMapResponse:
        try:
            self._use_map(request.map, self._initial_pose.read(request.initial_pose))
        except InputFault as fault:
            log.warning('set_map refused: %s', fault, extra=EVENT)
            return SetMapResponse(success=False)
        return SetMapResponse(success=True)

    # ---- scans

    def _on_scan(self, message: LaserScan) -> None:
        self._has_had_scan = True
        with self._lock:
            step = self._timeline.advance(ns_from_stamp(message.header.stamp))
            if step is Step.RESTART:
                self._restart()
            if step is not Step.STALE:
                self._queue.add(message)
        self._process()

    def _restart(self) -> None:
        log.warning('scan stamps went back: localization restarts at the initial_pose_* parameters', extra=EVENT)
        self._queue.clear()
        self._buffer.clear()
        if self._amcl is not None:
            self._amcl.set_map(self._amcl.grid)
            self._output.restart()

    def _process(self) -> None:
        with self._lock:
            if self._amcl is not None:
                self._queue.process()

    def _localize(self, scan: Scan, odom_pose: Pose2D, laser_pose: Pose2D) -> None:
        amcl = self._amcl
        if amcl is None:
            return  # the queue hands on no scan before there is a map
        estimate = amcl.update(odom_pose, scan, laser_pose)
        self._output.report(amcl, scan.stamp_ns, odom_pose, estimate)
        self._taken.publish(Header(stamp=stamp_from_ns(scan.stamp_ns)))

    def _on_silence(self, _: rospy.timer.TimerEvent) -> None:
        if not self._has_had_scan:
            log.warning('%s: no scan for %.0f s: the pose is not corrected', self._scans.resolved_name, SILENCE_S)
        self._has_had_scan = False

    # ---- requests

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        try:
            guess = self._initial_pose.read(message)
            with self._lock:
                if self._amcl is None:
                    self._guess = guess
                else:
                    self._amcl.set_pose(*guess)
        except InputFault as fault:
            log.warning('%s refused: %s', self._initial_poses.resolved_name, fault, extra=EVENT)

    def _on_global_localization(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            if self._amcl is not None:
                self._amcl.global_localization()
                log.info(
                    'global_localization: particles all over the map; drive the robot by hand until localized',
                    extra=EVENT,
                )
                self._output.expect_lost(self._amcl)
        return EmptyResponse()

    def _on_nomotion_update(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            if self._amcl is not None:
                self._amcl.request_nomotion_update()
        return EmptyResponse()


def _trial_defaults() -> Dict[str, Any]:
    plan = trial_plan()
    if plan is None:
        return {}
    start = plan.trial.test.start
    return {
        'initial_pose_x': start.x,
        'initial_pose_y': start.y,
        'initial_pose_a': start.yaw,
        'seed': plan.trial.number,
    }


def main() -> None:
    """Run the node."""
    run_node('amcl', AmclNode)
