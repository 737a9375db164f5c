"""amcl_node: localization with the topics, services, parameters and transform of upstream amcl."""

from __future__ import annotations

from typing import Dict, Optional, Tuple

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import SetMap, SetMapRequest, SetMapResponse
from pydantic import Field
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.bounds import PositiveDuration_s, Seed
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate, warm_up
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import check_covariance, check_pose
from diff_encoder_sim.ros import messages, node
from diff_encoder_sim.ros.maps import fetch_map, grid_from_message
from diff_encoder_sim.ros.reconfiguration import serve_amcl
from diff_encoder_sim.ros.transforms import ScanInput, TransformBuffer
from diff_encoder_sim.wheels.diagnostics import Diagnosis

PoseGuess = Tuple[Pose2D, np.ndarray]  # a base pose in the map with its 3x3 covariance over (x [m], y [m], yaw [rad])
PLANAR_ROWS_AND_COLUMNS = np.ix_((0, 1, 5), (0, 1, 5))  # of x, y and yaw in a message's 6x6 covariance


class AmclNodeParams(AmclParams):
    """Parameters of amcl_node and its filter."""

    seed: Seed = Field(0, description='of all random draws; default: the number of /trial')
    diagnostic_period: PositiveDuration_s = Field(1.0, description='between two messages on /diagnostics [s]')


class AmclNode:
    """Waits for a map, then updates the filter with each scan and the odometry at the scan's time."""

    def __init__(self) -> None:
        plan = node.trial_plan()
        defaults: Dict[str, float] = {}
        if plan is not None:
            start = plan.trial.test.start
            defaults = dict(initial_pose_x=start.x, initial_pose_y=start.y, initial_pose_a=start.yaw)
            defaults['seed'] = plan.trial.number
        params = node.node_params(AmclNodeParams, part='amcl', defaults=defaults)
        names = ('odom_frame_id', 'base_frame_id', 'global_frame_id')  # may begin with '/', as before tf2
        self._params = params.model_copy(update={name: getattr(params, name).lstrip('/') for name in names})
        node.compile_first(lambda: warm_up(self._params))
        self._amcl: Optional[Amcl] = None
        self._guess: Optional[PoseGuess] = None  # received before the map
        self._to_save: Optional[PoseGuess] = None  # the newest that can be
        self._saved: Optional[PoseGuess] = None
        self._rng = generator(self._params.seed, 'amcl')
        self._buffer = TransformBuffer(cache_s=30.0)
        self._transforms = messages.Publisher('/tf', TFMessage)
        self._poses = messages.Publisher('amcl_pose', PoseWithCovarianceStamped, latch=True)
        self._clouds = messages.Publisher('particlecloud', PoseArray, latch=True)
        self._used_scans = messages.Publisher('~scan_taken', Header)  # the simulator waits for it after each scan
        self._diagnostics = messages.Diagnostics('Standard deviation', self._params.diagnostic_period)
        self._was_uncertain = True  # the initial particles are spread
        self._saved_ns: Optional[int] = None  # stamp of the scan
        node.empty_service('global_localization', self._on_global_localization)
        node.empty_service('request_nomotion_update', self._on_nomotion_update)
        node.service('set_map', SetMap, self._on_set_map)
        self._initial_poses = messages.subscriber('initialpose', PoseWithCovarianceStamped, self._on_initial_pose)
        frames = self._params.base_frame_id, self._params.odom_frame_id
        self._scans = ScanInput(self._buffer, *frames, self._localize, self._on_restart, lambda: self._amcl is not None)
        if self._params.use_map_topic:
            messages.subscriber('map', OccupancyGridMessage, self._on_map)
        else:
            fetch_map(lambda message: self._on_map(message, is_first=True))
        rospy.on_shutdown(node.one_at_a_time(self._save))
        serve_amcl(self._params, self._reconfigure)

    def _reconfigure(self, params: AmclNodeParams) -> None:
        warm_up(params)  # compile a new model before the next scan
        self._params = params
        if self._amcl is not None:
            self._amcl.reconfigure(params)

    def _on_map(self, message: OccupancyGridMessage, is_first: bool = False) -> None:
        """Use a map of the topic, or the first of the service unless set_map was called before."""
        if self._amcl is None or not (is_first or self._params.first_map_only):
            try:
                self._use_map(message, self._guess or self._saved)
            except InputFault as fault:
                node.log.warning('map not used: %s', fault)

    def _use_map(self, message: OccupancyGridMessage, guess: Optional[PoseGuess]) -> None:
        """Start localization on a map at the guess, or by default at the initial_pose_* parameters."""
        grid = grid_from_message(message)
        frame, expected = message.header.frame_id.lstrip('/'), self._params.global_frame_id
        if frame != expected:
            node.log.warning('map: header.frame_id is %r; used as if it were %r (global_frame_id)', frame, expected)
        amcl = self._amcl or Amcl(self._params, grid, self._rng)
        if guess is not None or self._amcl is not None:
            amcl.set_map(grid, *(guess or ()))
        self._amcl, self._guess, self._was_uncertain = amcl, None, True

    def _on_restart(self, _stamp_ns: int) -> None:
        node.log.warning('scan stamps went back: localization restarts at the initial_pose_* parameters', extra=EVENT)
        self._buffer.clear()
        if self._amcl is not None:
            self._amcl.set_map(self._amcl.grid)
            self._was_uncertain, self._saved_ns = True, None

    def _localize(self, scan: Scan, odom_pose: Pose2D, laser_pose: Pose2D) -> None:
        amcl, params, stamp_ns, frame = self._amcl, self._params, scan.stamp_ns, self._params.global_frame_id
        assert amcl is not None  # scans wait for it
        count, was_lost = amcl.update_count, amcl.is_lost
        estimate = amcl.update(odom_pose, scan, laser_pose)
        if amcl.update_count > count:
            self._clouds.publish(encoders.encode_pose_array(amcl.particles, stamp_ns, frame))
        if estimate is not None:
            pose = estimate.base_pose_in_map, estimate.covariance
            self._poses.publish(encoders.encode_pose_with_covariance(*pose, stamp_ns, frame))
            diagnosis = spread_diagnosis(estimate, params)
            if diagnosis.warning and not self._was_uncertain:
                values = ', '.join(f'{key} {value:g}' for key, value in diagnosis.values.items())
                node.log.warning('uncertain pose: %s', values)
            self._was_uncertain = bool(diagnosis.warning)
        fit_percent, lost_percent = 100.0 * (amcl.fit_fraction or 0.0), 100.0 * params.lost_fraction
        if amcl.is_lost and not was_lost:
            node.log.warning(
                'localization lost: %.0f %% of the rays agree with the map (lost_fraction: %.0f %%); map -> odom is '
                'not published until enough do. Carry the robot back, set its pose by /initialpose, or call '
                'global_localization and drive it by hand',
                *(fit_percent, lost_percent),
                extra=EVENT,
            )
        elif was_lost and not amcl.is_lost:
            node.log.info('localized again: %.0f %% of the rays agree with the map', fit_percent, extra=EVENT)
        newest = amcl.last_estimate
        if newest is not None:
            self._diagnostics.publish_when_due(stamp_ns, lambda: spread_diagnosis(newest, params))
            if not amcl.is_lost:
                if params.tf_broadcast:
                    # With a future stamp, so that lookups succeed until the next scan.
                    until_ns = stamp_ns + round(params.transform_tolerance * NANOSECONDS_PER_SECOND)
                    transform = newest.odom_pose_in_map, until_ns, frame, params.odom_frame_id
                    self._transforms.publish(encoders.encode_planar_tf(*transform))
                self._to_save = newest.odom_pose_in_map.compose(odom_pose), newest.covariance
                rate, saved_ns = params.save_pose_rate, self._saved_ns
                if rate > 0.0 and (saved_ns is None or stamp_ns - saved_ns >= NANOSECONDS_PER_SECOND / rate):
                    self._saved_ns = stamp_ns
                    self._save()
        self._used_scans.publish(encoders.encode_header(stamp_ns, ''))

    def _save(self) -> None:
        """Write the pose to the initial_* parameters, the start of a restarted node."""
        if self._to_save is None or self._params.save_pose_rate <= 0.0:
            return
        pose, variances = self._to_save[0], np.diag(self._to_save[1])
        try:
            for name, value in zip(('pose_x', 'pose_y', 'pose_a', 'cov_xx', 'cov_yy', 'cov_aa'), (*pose, *variances)):
                rospy.set_param(f'~initial_{name}', float(value))
            self._saved = pose, np.diag(variances)
        except (rospy.ROSException, OSError) as error:
            node.log.warning('the pose could not be saved in the initial_* parameters: %s', error)

    def _on_set_map(self, request: SetMapRequest) -> SetMapResponse:
        try:
            self._use_map(request.map, read_initial_pose(request.initial_pose, self._params, self._buffer))
        except InputFault as fault:
            node.log.warning('set_map refused: %s', fault, extra=EVENT)
            return SetMapResponse(success=False)
        return SetMapResponse(success=True)

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        try:
            guess = read_initial_pose(message, self._params, self._buffer)
            if self._amcl is None:
                self._guess = guess
            else:
                self._amcl.set_pose(*guess)
        except InputFault as fault:
            node.log.warning('%s refused: %s', self._initial_poses.resolved_name, fault, extra=EVENT)

    def _on_global_localization(self) -> None:
        if self._amcl is not None:
            self._amcl.global_localization()
            node.log.info('global_localization: drive the robot by hand until it is localized', extra=EVENT)

    def _on_nomotion_update(self) -> None:
        if self._amcl is not None:
            self._amcl.request_nomotion_update()


def spread_diagnosis(estimate: AmclEstimate, params: AmclParams) -> Diagnosis:
    """Compare standard deviations with std_warn_level_*; text and keys are those of upstream amcl."""
    spread = dict(zip(('std_x', 'std_y', 'std_yaw'), np.sqrt(np.diag(estimate.covariance)).tolist()))
    limits = {name: getattr(params, name) for name in ('std_warn_level_x', 'std_warn_level_y', 'std_warn_level_yaw')}
    is_uncertain = any(map(float.__gt__, spread.values(), limits.values()))
    return Diagnosis('Too large' if is_uncertain else '', {**spread, **limits})


def read_initial_pose(message: PoseWithCovarianceStamped, params: AmclParams, buffer: tf2_ros.BufferCore) -> PoseGuess:
    """Return a message's pose, moved by odometry to now; InputFault if it is invalid or not in the map frame."""
    frame = message.header.frame_id.lstrip('/')
    if not frame:
        node.log.warning('initial pose: header.frame_id is empty; used as if it were %r', params.global_frame_id)
    elif frame != params.global_frame_id:
        raise InputFault(f'header.frame_id is {frame!r}; expected {params.global_frame_id!r}')
    pose = messages.pose_from_message(message.pose.pose)
    covariance = np.reshape(message.pose.covariance, (6, 6))[PLANAR_ROWS_AND_COLUMNS]
    check_pose(pose, 'initial pose')
    check_covariance(covariance)
    stamp, frames = message.header.stamp, (params.odom_frame_id, params.base_frame_id)
    if stamp.is_zero():  # zero means now
        return pose, covariance
    try:
        now = buffer.lookup_transform(*frames, rospy.Time(0))
        if stamp < now.header.stamp:
            then = buffer.lookup_transform(*frames, stamp)
            pose = pose.compose(messages.pose_from_transform(now).relative_to(messages.pose_from_transform(then)))
    except tf2_ros.TransformException as error:
        node.log.warning('initial pose: not corrected for the motion since its stamp: %s', error)
    return pose, covariance


main = node.executable('amcl', AmclNode)
