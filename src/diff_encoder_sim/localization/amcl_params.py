"""Parameters of AMCL under upstream's names and with upstream's defaults (navigation, Noetic).

Those of recovery_alpha_slow and recovery_alpha_fast are amcl_node.cpp's; AMCL.cfg has 0 and 0, which turn it off.
"""

from __future__ import annotations

import math
from typing import Any, Optional

from pydantic import BeforeValidator, Field, model_validator
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.bounds import Between, Distance_m, Fraction, Weight
from diff_encoder_sim.base.params import Params, param
from diff_encoder_sim.base.se2 import Pose2D


def _no_omni(value: Any) -> Any:
    if value in ('omni', 'omni-corrected'):
        raise ValueError("'diff' or 'diff-corrected' (a differential drive cannot move sideways)")
    return value


Alpha = Annotated[float, Between(0.0, 1000.0)]
Variance_rad2 = Annotated[float, Between(0.0, 1e8, 'rad^2')]
MotionModel = Annotated[Literal['diff', 'diff-corrected'], BeforeValidator(_no_omni)]
LaserModel = Literal['beam', 'likelihood_field', 'likelihood_field_prob']
FrameId = Annotated[str, Field(min_length=1)]


class AmclParams(Params):
    """All of upstream's parameters, so that its YAML files load; those at the end are the node's."""

    # The filter. kld_z is the standard normal quantile itself, not a probability (0.99 is 84 %).
    min_particles: Annotated[int, Between(1, 1_000_000)] = param(100, 'fewest particles')
    max_particles: Annotated[int, Between(1, 1_000_000)] = param(5000, 'most particles')
    kld_err: Annotated[float, Between(1e-6, 10.0)] = param(0.01, 'error of the distribution that limits particles')
    kld_z: Annotated[float, Between(0.0, 100.0)] = param(0.99, 'normal quantile of that error (0.99 is 84 %)')
    update_min_d: Distance_m = param(0.2, 'displacement along x or y of odom before an update [m]')
    update_min_a: bounds.Turn_rad = param(math.pi / 6.0, 'turn before an update [rad]')
    resample_interval: bounds.Count = param(2, 'updates from one resampling to the next')
    selective_resampling: bool = param(False, 'resample only when the effective number of particles is below half')
    recovery_alpha_slow: Fraction = param(0.001, 'decay of the slow average likelihood; 0: no random particles')
    recovery_alpha_fast: Fraction = param(0.1, 'decay of the fast average likelihood; 0: no random particles')
    force_update_after_initialpose: bool = param(False, 'update at the next scan after /initialpose, without motion')
    force_update_after_set_map: bool = param(False, 'update at the next scan after a new map, without motion')

    initial_pose_x: bounds.Place_m = param(0.0, 'mean of the initial pose [m]')
    initial_pose_y: bounds.Place_m = param(0.0, 'mean of the initial pose [m]')
    initial_pose_a: bounds.Angle_rad = param(0.0, 'mean of the initial yaw [rad]')
    initial_cov_xx: bounds.Variance_m2 = param(0.25, 'variance of the initial pose [m^2]')
    initial_cov_yy: bounds.Variance_m2 = param(0.25, 'variance of the initial pose [m^2]')
    initial_cov_aa: Variance_rad2 = param((math.pi / 12.0) ** 2, 'variance of the initial yaw [rad^2]')
    # The laser. Ranges of 0 or less stand for the scan's own range_min and range_max.
    laser_model_type: LaserModel = param('likelihood_field', 'sensor model')
    laser_min_range: bounds.Place_m = param(-1.0, 'shorter ranges are left out [m]; 0 or less: as in the scan')
    laser_max_range: bounds.Place_m = param(-1.0, 'longer ranges count as no return [m]; 0 or less: as in the scan')
    laser_max_beams: Annotated[int, Between(2, 100_000)] = param(30, 'rays of a scan that are used, evenly spaced')
    laser_z_hit: Weight = param(0.95, 'weight of a hit in the mixture')
    laser_z_short: Weight = param(0.1, 'weight of an unexpected obstacle (beam model)')
    laser_z_max: Weight = param(0.05, 'weight of a ray without a return (beam model)')
    laser_z_rand: Weight = param(0.05, 'weight of a random range')
    laser_sigma_hit: Annotated[float, Between(1e-4, 1000.0, 'm')] = param(0.2, 'standard deviation of a hit [m]')
    laser_lambda_short: Annotated[float, Between(0.0, 1e4, '1/m')] = param(0.1, 'of unexpected obstacles [1/m]')
    laser_likelihood_max_dist: Annotated[float, Between(1e-3, 1000.0, 'm')] = param(2.0, 'distances are cut here [m]')
    do_beamskip: bool = param(False, 'leave out rays that most particles do not explain (likelihood_field_prob)')
    beam_skip_distance: Distance_m = param(0.5, 'from the map, for a ray to be explained [m]')
    beam_skip_threshold: Fraction = param(0.3, 'fraction of particles that must explain a ray')
    beam_skip_error_threshold: Fraction = param(0.9, 'fraction of rays left out above which all are used')
    beam_skip_error_threshold_: Optional[Fraction] = Field(None, exclude=True, description='older name of the same')
    # The odometry.
    odom_model_type: MotionModel = param('diff', 'motion model; diff passes variances as standard deviations')
    odom_alpha1: Alpha = param(0.2, 'noise of the rotation from rotation')
    odom_alpha2: Alpha = param(0.2, 'noise of the rotation from translation')
    odom_alpha3: Alpha = param(0.2, 'noise of the translation from translation')
    odom_alpha4: Alpha = param(0.2, 'noise of the translation from rotation')
    odom_alpha5: Alpha = param(0.2, 'accepted, without effect: of the omni models')
    axle_x: bounds.Offset_m = param(0.0, "not upstream's: place of the axle ahead of the origin of base_frame_id [m]")
    # When the robot counts as lost. Not upstream's parameters; 0 is upstream's behaviour: never.
    lost_fraction: Fraction = param(0.0, 'fraction of fitting rays of a bad scan; 0: never lost')
    lost_distance: bounds.PositiveDistance_m = param(0.2, 'largest distance from the map for a ray to fit [m]')
    lost_scans: bounds.Count = param(5, 'bad scans in a row until it is lost, good ones until found')
    # The node's.
    odom_frame_id: FrameId = param('odom', 'frame of the odometry')
    base_frame_id: FrameId = param('base_link', 'frame of the robot')
    global_frame_id: FrameId = param('map', 'frame of the map')
    tf_broadcast: bool = param(True, 'broadcast map -> odom on TF')
    transform_tolerance: bounds.Duration_s = param(0.1, 'time by which map -> odom is post-dated [s]')
    save_pose_rate: bounds.SignedRate_Hz = param(0.5, 'rate at which the pose is stored [Hz]; 0 or less: never')
    gui_publish_rate: bounds.SignedRate_Hz = param(-1.0, 'accepted, without effect [Hz]')
    use_map_topic: bool = param(False, 'take the map from /map instead of the service static_map')
    first_map_only: bool = param(False, 'with use_map_topic: ignore later maps')
    std_warn_level_x: Distance_m = param(0.2, 'warn above this standard deviation of x [m]')
    std_warn_level_y: Distance_m = param(0.2, 'warn above this standard deviation of y [m]')
    std_warn_level_yaw: bounds.Turn_rad = param(0.1, 'warn above this standard deviation of yaw [rad]')
    bag_scan_period: bounds.SignedDuration_s = param(-1.0, 'accepted, without effect [s]')
    restore_defaults: bool = Field(False, exclude=True, description='accepted, without effect: of dynamic_reconfigure')

    def initial_pose(self) -> Pose2D:
        """Return the pose (base in the map) to start from."""
        return Pose2D(self.initial_pose_x, self.initial_pose_y, self.initial_pose_a)

    @model_validator(mode='before')
    @classmethod
    def _take_older_name(cls, given: Any) -> Any:
        older = 'beam_skip_error_threshold_'  # dynamic_reconfigure's name; it takes precedence
        return given if given.get(older) is None else {**given, older[:-1]: given[older], older: None}

    @model_validator(mode='after')
    def _check_particle_range(self) -> AmclParams:
        if self.min_particles > self.max_particles:
            raise ValueError(f'min_particles ({self.min_particles}) of at most max_particles ({self.max_particles})')
        return self
