"""amcl_node: localization on upstream amcl's topics, services, parameters and transform."""

from __future__ import annotations

import math
import threading
from typing import Any, Dict, NamedTuple, Optional, Tuple

import numpy as np
import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
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
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.drives.pose_messages import encode_pose_array
from diff_encoder_sim.drives.topics import DIAGNOSTICS
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate, warm_up
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import check_covariance, check_pose
from diff_encoder_sim.ros.conversions import (
    ns_from_stamp,
    pose_covariance_from_message,
    pose_from_message,
    pose_from_transform,
    pose_with_covariance_message,
    stamp_from_ns,
    transform_message,
)
from diff_encoder_sim.ros.encoded_topics import DisplayTopic, EncodedPublisher, stamped_subscriber
from diff_encoder_sim.ros.maps import fetch_map, grid_from_message
from diff_encoder_sim.ros.node import compile_first, log, node_params, publisher, run_node, subscriber, trial_plan
from diff_encoder_sim.ros.reconfiguration import serve_amcl
from diff_encoder_sim.ros.transforms import SCANS_MOST_AHEAD_S, ScanQueue, TransformBuffer


class AmclOutput:
    """Publishes the state of the filter after each scan."""

    def __init__(self, params: AmclParams, diagnostic_period_s: float) -> None:
        self.params = params
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._poses = publisher('amcl_pose', PoseWithCovarianceStamped, latch=True)
        self._clouds = EncodedPublisher('particlecloud', PoseArray, latch=True)
        # The newest that can be saved, and the one that was saved: pose in the map, covariance.
        self._to_save: Optional[Tuple[Pose2D, np.ndarray]] = None
        self.saved: Optional[Tuple[Pose2D, np.ndarray]] = None
        self._spread = AmclSpread(diagnostic_period_s)
        self.restart()

    def restart(self) -> None:
        """Start anew with localization: warn again of what was warned of before."""
        self._was_lost = False
        self._spread.restart()
        self._seen_updates = 0
        self._saved_ns: Optional[int] = None

    def expect_lost(self, amcl: Amcl) -> None:
        """Do not warn that the robot is lost, where the user has requested it (global_localization)."""
        self._was_lost = amcl.is_lost

    def report(self, amcl: Amcl, stamp_ns: int, odom_pose: Pose2D, estimate: Optional[AmclEstimate]) -> None:
        """Publish the result of a scan that was taken at `odom_pose`; `estimate` if there is a new one."""
        if amcl.update_count != self._seen_updates:
            self._seen_updates = amcl.update_count
            self._publish_cloud(amcl, stamp_ns)
        if estimate is not None:
            self._poses.publish(
                pose_with_covariance_message(
                    estimate.base_pose_in_map, estimate.covariance, stamp_ns, self.params.global_frame_id
                )
            )
            self._spread.warn(estimate, self.params)
        self._warn_of_loss(amcl)
        if amcl.last_estimate is not None:
            self._spread.diagnose(amcl.last_estimate, self.params, stamp_ns)
        if amcl.last_estimate is not None and not amcl.is_lost:
            odom_pose_in_map = amcl.last_estimate.odom_pose_in_map
            self._broadcast(odom_pose_in_map, stamp_ns)
            self._to_save = odom_pose_in_map.compose(odom_pose), amcl.last_estimate.covariance
            self._save_when_due(stamp_ns)

    def _publish_cloud(self, amcl: Amcl, stamp_ns: int) -> None:
        self._clouds.publish(encode_pose_array(amcl.particles, stamp_ns, self.params.global_frame_id))

    def _broadcast(self, odom_pose_in_map: Pose2D, stamp_ns: int) -> None:
        if not self.params.tf_broadcast:
            return
        # Dated ahead, so that until the next scan lookups at the time of newer odometry succeed.
        ahead_ns = round(self.params.transform_tolerance * NANOSECONDS_PER_SECOND)
        self._broadcaster.sendTransform(
            transform_message(
                odom_pose_in_map, stamp_ns + ahead_ns, self.params.global_frame_id, self.params.odom_frame_id
            )
        )

    # ---- warnings

    def _warn_of_loss(self, amcl: Amcl) -> None:
        fit_percent = 100.0 * (amcl.fit_fraction or 0.0)
        if amcl.is_lost and not self._was_lost:
            log.warning(
                'localization lost: %.0f %% of the rays agree with the map (lost_fraction: %.0f %%); map -> odom is '
                'not published until enough do. Carry the robot back, set its pose by /initialpose, or call '
                'global_localization and drive it by hand',
                fit_percent,
                100.0 * self.params.lost_fraction,
                extra=EVENT,
            )
        elif self._was_lost and not amcl.is_lost:
            log.info('localized again: %.0f %% of the rays agree with the map', fit_percent, extra=EVENT)
        self._was_lost = amcl.is_lost

    # ---- the saved pose

    def _save_when_due(self, stamp_ns: int) -> None:
        rate = self.params.save_pose_rate
        if rate > 0.0 and (self._saved_ns is None or stamp_ns - self._saved_ns >= NANOSECONDS_PER_SECOND / rate):
            self._saved_ns = stamp_ns
            self.save()

    def save(self) -> None:
        """Write the pose into the initial_* parameters, where a restarted node starts from."""
        if self._to_save is None or self.params.save_pose_rate <= 0.0:
            return
        pose, covariance = self._to_save
        try:
            for name, value in (
                ('pose_x', pose.x_m),
                ('pose_y', pose.y_m),
                ('pose_a', pose.yaw_rad),
                ('cov_xx', covariance[0, 0]),
                ('cov_yy', covariance[1, 1]),
                ('cov_aa', covariance[2, 2]),
            ):
                rospy.set_param(f'~initial_{name}', float(value))
        except (rospy.ROSException, OSError) as error:
            log.warning('the pose could not be saved in the initial_* parameters: %s', error)
            return
        self.saved = pose, np.diag(np.diag(covariance))


class Spread(NamedTuple):
    """Standard deviations of an estimate, or limits of them."""

    x: float  # [m]
    y: float  # [m]
    yaw: float  # [rad]

    def exceeds(self, limits: Spread) -> bool:
        """Return whether one of them is above its limit."""
        return any(value > limit for value, limit in zip(self, limits))


class AmclSpread:
    """Compares each estimate with std_warn_level_*, as upstream's diagnostics."""

    def __init__(self, diagnostic_period_s: float) -> None:
        self._period_ns = diagnostic_period_s * NANOSECONDS_PER_SECOND
        self._diagnostics = DisplayTopic(DIAGNOSTICS, DiagnosticArray, queue_size=10)
        self.restart()

    def restart(self) -> None:
        """Start anew with localization: at the start the particles are far apart, which is no reason for a warning."""
        self._was_exceeded = True

    def warn(self, estimate: AmclEstimate, params: AmclParams) -> None:
        """Log a warning where the estimate begins to exceed a limit."""
        spread, limits = _spread(estimate), _limits(params)
        is_exceeded = spread.exceeds(limits)
        if is_exceeded and not self._was_exceeded:
            log.warning(
                'uncertain pose: standard deviations %.2f m (x), %.2f m (y), %.0f degrees; above std_warn_level_* '
                '(%.2f m, %.2f m, %.0f degrees)',
                *spread[:2],
                math.degrees(spread.yaw),
                *limits[:2],
                math.degrees(limits.yaw),
            )
        self._was_exceeded = is_exceeded

    def diagnose(self, estimate: AmclEstimate, params: AmclParams, now_ns: int) -> None:
        """Publish the status of the newest estimate, once a period and to subscribers."""
        if self._diagnostics.is_due(self._period_ns, now_ns):
            message = DiagnosticArray(status=[spread_status(_spread(estimate), _limits(params))])
            message.header.stamp = stamp_from_ns(now_ns)
            self._diagnostics.publish(message)


def spread_status(spread: Spread, limits: Spread) -> DiagnosticStatus:
    """Return the status that upstream's amcl has, with its name, words and keys."""
    is_exceeded = spread.exceeds(limits)
    values = {
        **{f'std_{name}': value for name, value in spread._asdict().items()},
        **{f'std_warn_level_{name}': value for name, value in limits._asdict().items()},
    }
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if is_exceeded else DiagnosticStatus.OK,
        name=f'{rospy.get_name().lstrip("/")}: Standard deviation',
        message='Too large' if is_exceeded else 'OK',
        hardware_id='None',
        values=[KeyValue(key, f'{value:g}') for key, value in values.items()],
    )


def _spread(estimate: AmclEstimate) -> Spread:
    return Spread(*np.sqrt(np.diag(estimate.covariance)).tolist())


def _limits(params: AmclParams) -> Spread:
    return Spread(params.std_warn_level_x, params.std_warn_level_y, params.std_warn_level_yaw)


# A base pose in the map with its 3x3 covariance over (x [m], y [m], yaw [rad]).
PoseGuess = Tuple[Pose2D, np.ndarray]


class InitialPoseReader:
    """Reads messages with a pose in the map; the frames are those of the parameters."""

    def __init__(self, params: AmclParams, buffer: tf2_ros.Buffer) -> None:
        self._global_frame = params.global_frame_id
        self._odom_to_base = params.odom_frame_id, params.base_frame_id
        self._buffer = buffer

    def read(self, message: PoseWithCovarianceStamped) -> PoseGuess:
        """Return the pose that a message gives, moved by odometry from the message's stamp to now.

        Raises:
            InputFault: it is no valid pose, or in another frame than the map's.
        """
        frame = message.header.frame_id.lstrip('/')
        if not frame:
            log.warning('initial pose: header.frame_id is empty; used as if it were %r', self._global_frame)
        elif frame != self._global_frame:
            raise InputFault(f'header.frame_id is {frame!r}; expected {self._global_frame!r}')
        pose = pose_from_message(message.pose.pose)
        covariance = pose_covariance_from_message(message.pose.covariance)
        check_pose(pose, 'initial pose')
        check_covariance(covariance)
        return pose.compose(self._moved_since(message.header.stamp)), covariance

    def _moved_since(self, stamp: rospy.Time) -> Pose2D:
        """Return the base's pose now in the base frame at a stamp, by odometry; a stamp of 0 means now."""
        try:
            now = self._buffer.lookup_transform(*self._odom_to_base, rospy.Time(0))
            if stamp.is_zero() or stamp >= now.header.stamp:
                return IDENTITY
            then = self._buffer.lookup_transform(*self._odom_to_base, stamp)
        except tf2_ros.TransformException as error:
            if not stamp.is_zero():
                log.warning('initial pose: not corrected for the motion since its stamp: %s', error)
            return IDENTITY
        return pose_from_transform(now).relative_to(pose_from_transform(then))


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
