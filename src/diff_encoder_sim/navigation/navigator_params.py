"""Parameters of the navigator: move_base's, with those of its parts in move_base's namespaces."""

from __future__ import annotations

from typing import Any, List

from pydantic import Field, model_validator
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base.bounds import Between, Distance_m, Duration_s, Place_m, PositiveDuration_s, RateOrZero_Hz
from diff_encoder_sim.base.params import Params, param
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.global_planner import NavfnParams

RecoveryType = Literal['clear_costmap_recovery/ClearCostmapRecovery', 'rotate_recovery/RotateRecovery']
CLEAR_COSTMAP: RecoveryType = 'clear_costmap_recovery/ClearCostmapRecovery'
ROTATE: RecoveryType = 'rotate_recovery/RotateRecovery'


class BehaviourParams(Params):
    """Entry of recovery_behaviors."""

    name: str = Field(min_length=1, description='of the behaviour, each its own')
    type: RecoveryType = Field(description='type of the behaviour')


class NavigatorParams(Params):
    """Parameters below move_base's private namespace."""

    controller_frequency: Annotated[float, Between(1e-3, 1000.0, 'Hz')] = param(20.0, 'rate of velocity commands [Hz]')
    planner_frequency: RateOrZero_Hz = param(0.0, 'rate of new plans while driving [Hz]; 0: only when one is needed')
    planner_patience: Duration_s = param(5.0, 'time without a plan before recovery [s]')
    controller_patience: Duration_s = param(15.0, 'time without a command before recovery [s]')
    max_planning_retries: Annotated[int, Between(-1, 1_000_000)] = param(
        -1, 'attempts to plan before recovery; -1: no limit'
    )
    oscillation_timeout: Duration_s = param(0.0, 'time without progress before recovery [s]; 0: no limit')
    oscillation_distance: Distance_m = param(0.5, 'travel that counts as progress [m]')
    recovery_behavior_enabled: bool = param(True, 'try recovery behaviours before giving up')
    clearing_rotation_allowed: bool = param(True, "turn in place among upstream's usual recoveries")
    conservative_reset_dist: Distance_m = param(
        3.0, 'side of the square around the robot outside which the first recovery clears [m]'
    )
    input_timeout: PositiveDuration_s = param(0.5, 'odometry, localization or scan older than this stop the robot [s]')
    max_unseen_travel: Distance_m = param(
        0.3,
        'commanded travel while the pose of the odometry stays the same, before the goal is given up [m]; '
        '0: no limit, as upstream',
    )
    base_global_planner: Literal['navfn/NavfnROS'] = param('navfn/NavfnROS', 'the only value')
    base_local_planner: Literal['dwa_local_planner/DWAPlannerROS'] = param(
        'dwa_local_planner/DWAPlannerROS', 'the only value'
    )
    shutdown_costmaps: bool = param(False, 'accepted, without effect: costmaps are always kept up')
    recovery_behaviors: List[BehaviourParams] = param(
        [], "in the order in which they are tried; empty: upstream's usual four"
    )
    clearing_radius: Place_m = param(0.46, 'accepted, without effect, as upstream [m]')
    make_plan_clear_costmap: bool = param(True, 'accepted, without effect: planning changes no costmap')
    make_plan_add_unreachable_goal: bool = param(True, 'accepted, without effect: a plan ends at a reachable pose')
    restore_defaults: bool = param(False, 'accepted, without effect: of dynamic_reconfigure')
    latch_xy_goal_tolerance: bool = param(False, 'that of DWAPlannerROS, which upstream reads here')

    global_costmap: CostmapParams = param(CostmapParams(), 'of the whole map')
    local_costmap: CostmapParams = param(local_defaults(), 'around the robot')
    NavfnROS: NavfnParams = param(NavfnParams(), 'global planner')
    DWAPlannerROS: DwaParams = param(DwaParams(), 'local planner')

    @property
    def control_period_s(self) -> float:
        """Return the time between two steps of the navigator [s]."""
        return 1.0 / self.controller_frequency

    @model_validator(mode='before')
    @classmethod
    def _pass_latch_on(cls, given: Any) -> Any:
        """Pass latch_xy_goal_tolerance on to the DWA: upstream reads it here and not in the DWA's namespace."""
        name, planner = 'latch_xy_goal_tolerance', 'DWAPlannerROS'
        if not (isinstance(given, dict) and name in given and isinstance(given.get(planner, {}), dict)):
            return given
        return {**given, planner: {**given.get(planner, {}), name: given[name]}}

    @model_validator(mode='after')
    def _check_recoveries(self) -> NavigatorParams:
        names = [behaviour.name for behaviour in self.recovery_behaviors]
        if len(set(names)) < len(names):
            raise ValueError('recovery_behaviors with unique names')
        return self

    @model_validator(mode='after')
    def _check_together(self) -> NavigatorParams:
        if self.global_costmap.rolling_window or self.local_costmap.static_map:
            raise ValueError('a static global_costmap and a rolling local_costmap')
        frames = {costmap.global_frame.lstrip('/') for costmap in (self.global_costmap, self.local_costmap)}
        if len(frames) == 1:
            raise ValueError("local_costmap.global_frame that is /odom's, such as odom, and not global_costmap's")
        if not self.DWAPlannerROS.can_start(self.control_period_s):
            raise ValueError(
                'DWAPlannerROS whose min_vel_trans or min_vel_theta a standing robot can reach in one control '
                'period (acc_lim_x, acc_lim_theta over controller_frequency), else it never moves; '
                'min_vel_trans: 0.0 is safe'
            )
        return self
