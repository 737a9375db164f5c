"""Parameters of the navigator: move_base's, with those of its parts in move_base's namespaces."""

from __future__ import annotations

from typing import Any, List, NamedTuple

from pydantic import Field, model_validator
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.bounds import Between, Distance_m, Weight
from diff_encoder_sim.base.params import Params, param
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults

MOST_POINTS = 10_000_000  # of all trajectories of one control period: 240 MB

Samples = Annotated[int, Between(1, 1000)]
LatchMargin = Annotated[float, Between(0.0, 0.9)]
HalfTurn_rad = Annotated[float, Between(0.0, 3.2, 'rad')]
Stop = Literal['latch', 'precise']


class DwaParams(Params):
    """Limits of the robot, tolerances at the goal, simulation, sampling and weights; upstream's files can be read."""

    max_vel_trans: bounds.Speed_mps = param(0.55, 'highest speed [m/s]')
    min_vel_trans: bounds.Speed_mps = param(0.1, 'a slower sample must at least turn with min_vel_theta [m/s]')
    max_vel_x: bounds.Velocity_mps = param(0.55, 'highest forward velocity [m/s]')
    min_vel_x: bounds.Velocity_mps = param(0.0, 'lowest forward velocity; negative: may drive backwards [m/s]')
    max_vel_y: bounds.Velocity_mps = param(0.0, 'accepted, without effect [m/s]')
    min_vel_y: bounds.Velocity_mps = param(0.0, 'accepted, without effect [m/s]')
    max_vel_theta: bounds.PositiveTurnRate_radps = param(1.0, 'highest turning rate [rad/s]')
    min_vel_theta: bounds.TurnRate_radps = param(0.4, 'lowest turning rate of a turn in place [rad/s]')
    acc_lim_x: bounds.PositiveAcceleration_mps2 = param(2.5, 'highest acceleration [m/s^2]')
    acc_lim_y: bounds.Acceleration_mps2 = param(2.5, 'accepted, without effect [m/s^2]')
    acc_lim_theta: bounds.PositiveTurnAcceleration_radps2 = param(3.2, 'highest angular acceleration [rad/s^2]')
    acc_lim_trans: bounds.Acceleration_mps2 = param(0.1, 'accepted, without effect, as upstream [m/s^2]')

    xy_goal_tolerance: bounds.PositiveDistance_m = param(0.1, 'distance from the goal that counts as reached [m]')
    yaw_goal_tolerance: bounds.PositiveTurn_rad = param(0.1, 'heading error that counts as reached [rad]')
    latch_xy_goal_tolerance: bool = param(False, 'once within xy_goal_tolerance, only turn')
    trans_stopped_vel: bounds.Speed_mps = param(0.1, 'slower counts as standing [m/s]')
    theta_stopped_vel: bounds.TurnRate_radps = param(0.1, 'slower counts as standing [rad/s]')

    sim_time: Annotated[float, Between(0.01, 20.0, 's')] = param(1.7, 'duration of a trajectory [s]')
    sim_granularity: bounds.Length_m = param(0.025, 'distance between its points [m]')
    angular_sim_granularity: Annotated[float, Between(1e-3, 100.0, 'rad')] = param(0.1, 'turn between its points [rad]')
    vx_samples: Samples = param(3, 'forward velocities that are tried')
    vy_samples: Annotated[int, Between(-1_000_000, 1_000_000)] = param(10, 'accepted, without effect')
    vth_samples: Samples = param(20, 'turning rates that are tried')
    use_dwa: bool = param(True, 'sample what one control period reaches; false: sim_time, as base_local_planner')

    path_distance_bias: Weight = param(32.0, 'weight of the distance from the path')
    goal_distance_bias: Weight = param(24.0, 'weight of the distance from the goal')
    occdist_scale: Weight = param(0.01, 'weight of the cost under the robot')
    twirling_scale: Weight = param(0.0, 'weight of turning')
    forward_point_distance: bounds.Offset_m = param(0.325, 'of the point ahead of the robot that is scored [m]')
    cheat_factor: Weight = param(1.0, 'it is scored farther from the goal than its distance times the root of this')
    sum_scores: bool = param(False, 'sum the cost under the robot along a trajectory; false: its maximum')
    oscillation_reset_dist: Distance_m = param(0.05, 'travel that allows the opposite direction again [m]')
    oscillation_reset_angle: bounds.Turn_rad = param(0.2, 'turn that allows the opposite direction again [rad]')
    twist_sigmas: Weight = param(0.0, "standard deviations of odometry's twist within which the last command counts")
    latch_margin: LatchMargin = param(0.0, 'fraction of xy_goal_tolerance to be inside before a latch')
    stop: Stop = param(
        'latch', 'latch: within the tolerances, as upstream; precise: go on to the nearest place in them'
    )
    turn_to_path_angle: HalfTurn_rad = param(2.0, 'turn in place to plans at a larger angle [rad]; 0: as upstream')
    prune_plan: bool = param(True, 'drop the part of the plan behind the robot')

    stop_time_buffer: bounds.Duration_s = param(0.2, 'accepted, without effect, as upstream [s]')
    scaling_speed: bounds.Speed_mps = param(0.25, 'accepted, without effect, as upstream [m/s]')
    max_scaling_factor: Weight = param(0.2, 'accepted, without effect, as upstream')
    publish_traj_pc: bool = param(False, 'publish trajectory_cloud to subscribers')
    publish_cost_grid_pc: bool = param(False, 'publish cost_cloud to subscribers')
    global_frame_id: str = param('odom', 'accepted, without effect')
    odom_topic: Literal['odom', '/odom'] = param('odom', 'remap the node for another topic')
    restore_defaults: bool = param(False, 'accepted, without effect: of dynamic_reconfigure')

    @model_validator(mode='after')
    def _check_ranges(self) -> DwaParams:
        if self.min_vel_x > self.max_vel_x:
            raise ValueError('min_vel_x not above max_vel_x')
        if self.min_vel_theta > self.max_vel_theta:
            raise ValueError('min_vel_theta not above max_vel_theta')
        speed_mps = min(self.max_vel_trans, max(abs(self.min_vel_x), abs(self.max_vel_x)))
        steps = self.sim_time * max(speed_mps / self.sim_granularity, self.max_vel_theta / self.angular_sim_granularity)
        if self.vx_samples * self.vth_samples * steps > MOST_POINTS:
            names = 'vx_samples, vth_samples, sim_time and granularities'
            raise ValueError(f'{names} of no more than {MOST_POINTS:,} points in all')
        return self

    def can_start(self, control_period_s: float) -> bool:
        """Return whether a standing robot has any sample that min_vel_trans and min_vel_theta do not reject."""
        if not self.use_dwa:
            return True
        change_mps = self.acc_lim_x * control_period_s
        fastest_mps = max(min(self.max_vel_x, change_mps), -max(self.min_vel_x, -change_mps))
        fastest_radps = min(self.max_vel_theta, self.acc_lim_theta * control_period_s)
        return fastest_mps >= self.min_vel_trans or fastest_radps >= self.min_vel_theta


DwaType = Literal['dwa_local_planner/DWAPlannerROS']
RecoveryType = Literal['clear_costmap_recovery/ClearCostmapRecovery', 'rotate_recovery/RotateRecovery']
CLEAR_COSTMAP: RecoveryType = 'clear_costmap_recovery/ClearCostmapRecovery'
ROTATE: RecoveryType = 'rotate_recovery/RotateRecovery'


class NavfnParams(Params):
    """Parameters of the global planner, under navfn's and global_planner's names."""

    allow_unknown: bool = param(True, 'plan through unknown cells')
    default_tolerance: Distance_m = param(0.0, 'how far from a blocked goal a plan may end [m]')
    use_dijkstra: bool = param(True, 'false: A*')
    neutral_cost: Annotated[float, Between(1.0, 253.0)] = param(50.0, 'cost of a free cell')
    cost_factor: Weight = param(0.8, "weight of the costmap's cost, added to it")
    planner_window_x: bounds.Place_m = param(0.0, 'accepted, without effect, as upstream [m]')
    planner_window_y: bounds.Place_m = param(0.0, 'accepted, without effect, as upstream [m]')
    visualize_potential: bool = param(False, 'accepted, without effect')


class BehaviourParams(Params):
    """Entry of recovery_behaviors."""

    name: str = Field(min_length=1, description='of the behaviour, each its own')
    type: RecoveryType = Field(description='type of the behaviour')


class NavigatorParams(Params):
    """Parameters below move_base's private namespace."""

    controller_frequency: Annotated[float, Between(1e-3, 1000.0, 'Hz')] = param(20.0, 'rate of velocity commands [Hz]')
    planner_frequency: bounds.RateOrZero_Hz = param(0.0, 'rate of new plans [Hz]; 0: when one is needed')
    planner_patience: bounds.Duration_s = param(5.0, 'time without a plan before recovery [s]')
    controller_patience: bounds.Duration_s = param(15.0, 'time without a command before recovery [s]')
    max_planning_retries: Annotated[int, Between(-1, 1_000_000)] = param(-1, 'plans before recovery; -1: no limit')
    oscillation_timeout: bounds.Duration_s = param(0.0, 'time without progress before recovery [s]; 0: no limit')
    oscillation_distance: Distance_m = param(0.5, 'travel that counts as progress [m]')
    recovery_behavior_enabled: bool = param(True, 'try recovery behaviours before giving up')
    clearing_rotation_allowed: bool = param(True, "turn in place among upstream's usual recoveries")
    conservative_reset_dist: Distance_m = param(3.0, 'side of the square outside which the first recovery clears [m]')
    input_timeout: bounds.PositiveDuration_s = param(0.5, 'age of an input that stops the robot [s]')
    max_unseen_travel: Distance_m = param(0.3, 'commanded travel without odometry that ends a goal [m]; 0: no limit')
    base_global_planner: Literal['navfn/NavfnROS'] = param('navfn/NavfnROS', 'the only value')
    base_local_planner: DwaType = param('dwa_local_planner/DWAPlannerROS', 'the only value')
    shutdown_costmaps: bool = param(False, 'accepted, without effect: costmaps are always kept up')
    recovery_behaviors: List[BehaviourParams] = param([], "as they are tried; empty: upstream's usual four")
    clearing_radius: bounds.Place_m = param(0.46, 'accepted, without effect, as upstream [m]')
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
        if isinstance(given, dict) and name in given and isinstance(given.get(planner, {}), dict):
            return {**given, planner: {**given.get(planner, {}), name: given[name]}}
        return given

    @model_validator(mode='after')
    def _check_together(self) -> NavigatorParams:
        if len({behaviour.name for behaviour in self.recovery_behaviors}) < len(self.recovery_behaviors):
            raise ValueError('recovery_behaviors with unique names')
        if self.global_costmap.rolling_window or self.local_costmap.static_map:
            raise ValueError('a static global_costmap and a rolling local_costmap')
        frames = {costmap.global_frame.lstrip('/') for costmap in (self.global_costmap, self.local_costmap)}
        if len(frames) == 1:
            raise ValueError("local_costmap.global_frame that is /odom's, such as odom, and not global_costmap's")
        if not self.DWAPlannerROS.can_start(self.control_period_s):
            raise ValueError(
                'DWAPlannerROS whose min_vel_trans or min_vel_theta a standing robot can reach in one control period '
                '(acc_lim_x, acc_lim_theta over controller_frequency), else it never moves; min_vel_trans: 0.0 is safe'
            )
        return self


# move_base's default: clear far away, turn, clear close by, turn.
TURN = ('rotate_recovery', ROTATE)
USUAL = (('conservative_reset', CLEAR_COSTMAP), TURN, ('aggressive_reset', CLEAR_COSTMAP), TURN)
RESET_DISTANCE_M = 3.0  # clear_costmap_recovery's default, for behaviours of other names


class Recovery(NamedTuple):
    """One behaviour: a turn, or forgetting obstacles outside a square around the robot (clear_costmap_recovery)."""

    name: str
    type: RecoveryType
    reset_distance_m: float  # side of the square


def recoveries_of(params: NavigatorParams, circumscribed_radius_m: float) -> List[Recovery]:
    """Return the behaviours that the parameters list, in the order in which they are tried."""
    if not params.recovery_behavior_enabled:
        return []
    usual = [one for one in USUAL if params.clearing_rotation_allowed or one is not TURN]
    wanted = [(one.name, one.type) for one in params.recovery_behaviors] or usual
    sides_m = {'conservative_reset': params.conservative_reset_dist, 'aggressive_reset': 4.0 * circumscribed_radius_m}
    return [Recovery(name, kind, sides_m.get(name, RESET_DISTANCE_M)) for name, kind in wanted]
