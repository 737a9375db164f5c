"""Parameters of AMCL under upstream's names and with upstream's defaults (navigation, Noetic).

Upstream's amcl_node.cpp and its AMCL.cfg disagree on recovery_alpha_slow and recovery_alpha_fast;
the node starts with its own 0.001 and 0.1, so those are the defaults here. 0 and 0 turn it off.
"""

from __future__ import annotations

import math
from typing import Any, Optional

from pydantic import BeforeValidator, Field, model_validator
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base.typed_params import Params


def _no_omni(value: Any) -> Any:
    if value in ('omni', 'omni-corrected'):
        raise ValueError("'diff' or 'diff-corrected' (a differential drive cannot move sideways)")
    return value


Alpha = Annotated[float, Field(ge=0)]
MixtureWeight = Annotated[float, Field(ge=0)]
Probability = Annotated[float, Field(ge=0, le=1)]
FrameId = Annotated[str, Field(min_length=1)]


class AmclParams(Params):
    """All of upstream's parameters, so that its YAML files load; the node uses those at the end."""

    # The filter. kld_z is the standard normal quantile itself, not a probability (0.99 is 84 %).
    min_particles: int = Field(100, ge=1)
    max_particles: int = Field(5000, ge=1, le=1_000_000)
    kld_err: float = Field(0.01, gt=0, description='largest error of the distribution')
    kld_z: float = Field(0.99, ge=0)
    update_min_d: float = Field(0.2, ge=0, description='along x or y of odom, to update [m]')
    update_min_a: float = Field(math.pi / 6.0, ge=0, description='turn, to update [rad]')
    resample_interval: int = Field(2, ge=1, description='updates from one resampling to the next')
    selective_resampling: bool = False
    recovery_alpha_slow: Probability = 0.001
    recovery_alpha_fast: Probability = 0.1
    force_update_after_initialpose: bool = False
    force_update_after_set_map: bool = False

    initial_pose_x: float = 0.0  # [m]
    initial_pose_y: float = 0.0  # [m]
    initial_pose_a: float = 0.0  # [rad]
    initial_cov_xx: float = Field(0.25, ge=0)  # [m^2]
    initial_cov_yy: float = Field(0.25, ge=0)  # [m^2]
    initial_cov_aa: float = Field((math.pi / 12.0) ** 2, ge=0)  # [rad^2]

    # The laser. Ranges of 0 or less stand for what the scan itself says.
    laser_model_type: Literal['beam', 'likelihood_field', 'likelihood_field_prob'] = 'likelihood_field'
    laser_min_range: float = -1.0  # [m]
    laser_max_range: float = -1.0  # [m]
    laser_max_beams: int = Field(30, ge=2)
    laser_z_hit: MixtureWeight = 0.95
    laser_z_short: MixtureWeight = 0.1
    laser_z_max: MixtureWeight = 0.05
    laser_z_rand: MixtureWeight = 0.05
    laser_sigma_hit: float = Field(0.2, gt=0, description='[m]')
    laser_lambda_short: float = Field(0.1, ge=0, description='[1/m]')
    laser_likelihood_max_dist: float = Field(2.0, gt=0, description='[m]')
    do_beamskip: bool = False
    beam_skip_distance: float = Field(0.5, ge=0, description='[m]')
    beam_skip_threshold: Probability = 0.3
    beam_skip_error_threshold: Probability = 0.9
    beam_skip_error_threshold_: Optional[Probability] = Field(None, exclude=True, description='older name of the same')

    # The odometry. Alphas: rotation from rotation, rotation from translation, translation from
    # translation, translation from rotation; the fifth is of the omni models only.
    odom_model_type: Annotated[Literal['diff', 'diff-corrected'], BeforeValidator(_no_omni)] = 'diff'
    odom_alpha1: Alpha = 0.2
    odom_alpha2: Alpha = 0.2
    odom_alpha3: Alpha = 0.2
    odom_alpha4: Alpha = 0.2
    odom_alpha5: Alpha = 0.2

    # When the robot counts as lost. Not upstream's: lost_fraction 0 is never, as upstream has it.
    lost_fraction: Probability = Field(0.0, description='of rays that fit; below, a scan is bad')
    lost_distance: float = Field(0.2, gt=0, description='from the map, for a ray to fit [m]')
    lost_scans: int = Field(5, ge=1, description='bad scans in a row to be lost, good to be found')

    # What only the node uses.
    odom_frame_id: FrameId = 'odom'
    base_frame_id: FrameId = 'base_link'
    global_frame_id: FrameId = 'map'
    tf_broadcast: bool = True
    transform_tolerance: float = Field(0.1, ge=0, description='post-dates map->odom [s]')
    save_pose_rate: float = 0.5  # [Hz]; 0 or less: never
    gui_publish_rate: float = -1.0  # [Hz]
    use_map_topic: bool = False
    first_map_only: bool = False
    std_warn_level_x: float = Field(0.2, ge=0, description='[m]')
    std_warn_level_y: float = Field(0.2, ge=0, description='[m]')
    std_warn_level_yaw: float = Field(0.1, ge=0, description='[rad]')
    bag_scan_period: float = -1.0  # [s]
    restore_defaults: bool = Field(False, exclude=True, description='accepted; of dynamic_reconfigure')

    @model_validator(mode='before')
    @classmethod
    def _take_older_name(cls, given: Any) -> Any:
        older = 'beam_skip_error_threshold_'  # as dynamic_reconfigure has it; goes first
        if given.get(older) is None:
            return given
        return {**given, older[:-1]: given[older], older: None}

    @model_validator(mode='after')
    def _check_particle_range(self) -> AmclParams:
        if self.min_particles > self.max_particles:
            raise ValueError(f'min_particles ({self.min_particles}) of at most max_particles ({self.max_particles})')
        return self
