"""Parameters of the local planner, under dwa_local_planner's names and with its defaults.

Exceptions are prune_plan and the weights of path and goal, which config/navigation.yaml sets.
"""

from __future__ import annotations

from pydantic import model_validator
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base.bounds import (
    Acceleration_mps2,
    Between,
    Distance_m,
    Duration_s,
    Offset_m,
    PositiveAcceleration_mps2,
    PositiveDistance_m,
    PositiveTurn_rad,
    PositiveTurnAcceleration_radps2,
    PositiveTurnRate_radps,
    Speed_mps,
    Turn_rad,
    TurnRate_radps,
    Velocity_mps,
    Weight,
)
from diff_encoder_sim.base.params import Params, param

# Of all trajectories of one control period: 240 MB.
MOST_POINTS = 10_000_000


class DwaParams(Params):
    """Limits of the robot, tolerances at the goal, simulation, sampling and weights.

    A differential drive does not move sideways: the names for y are accepted, so that upstream's files can be read,
    and have no effect.
    """

    max_vel_trans: Speed_mps = param(0.55, 'highest speed [m/s]')
    min_vel_trans: Speed_mps = param(0.1, 'a slower sample must at least turn with min_vel_theta [m/s]')
    max_vel_x: Velocity_mps = param(0.55, 'highest forward velocity [m/s]')
    min_vel_x: Velocity_mps = param(0.0, 'lowest forward velocity; negative: may drive backwards [m/s]')
    max_vel_y: Velocity_mps = param(0.0, 'accepted, without effect [m/s]')
    min_vel_y: Velocity_mps = param(0.0, 'accepted, without effect [m/s]')
    max_vel_theta: PositiveTurnRate_radps = param(1.0, 'highest turning rate [rad/s]')
    min_vel_theta: TurnRate_radps = param(0.4, 'lowest turning rate of a turn in place, also at the goal [rad/s]')
    acc_lim_x: PositiveAcceleration_mps2 = param(2.5, 'highest acceleration [m/s^2]')
    acc_lim_y: Acceleration_mps2 = param(2.5, 'accepted, without effect [m/s^2]')
    acc_lim_theta: PositiveTurnAcceleration_radps2 = param(3.2, 'highest angular acceleration [rad/s^2]')
    acc_lim_trans: Acceleration_mps2 = param(0.1, 'accepted, without effect, as upstream [m/s^2]')

    xy_goal_tolerance: PositiveDistance_m = param(0.1, 'distance from the goal that counts as reached [m]')
    yaw_goal_tolerance: PositiveTurn_rad = param(0.1, 'heading error that counts as reached [rad]')
    latch_xy_goal_tolerance: bool = param(False, 'once within xy_goal_tolerance, only turn')
    trans_stopped_vel: Speed_mps = param(0.1, 'slower counts as standing [m/s]')
    theta_stopped_vel: TurnRate_radps = param(0.1, 'slower counts as standing [rad/s]')

    sim_time: Annotated[float, Between(0.01, 20.0, 's')] = param(1.7, 'duration of a trajectory [s]')
    sim_granularity: Annotated[float, Between(1e-3, 100.0, 'm')] = param(0.025, 'distance between its points [m]')
    angular_sim_granularity: Annotated[float, Between(1e-3, 100.0, 'rad')] = param(0.1, 'turn between its points [rad]')
    vx_samples: Annotated[int, Between(1, 1000)] = param(3, 'forward velocities that are tried')
    vy_samples: Annotated[int, Between(-1_000_000, 1_000_000)] = param(10, 'accepted, without effect')
    vth_samples: Annotated[int, Between(1, 1000)] = param(20, 'turning rates that are tried')
    use_dwa: bool = param(
        True, 'sample what is reachable in one control period; false: in sim_time, as base_local_planner'
    )

    path_distance_bias: Weight = param(32.0, 'weight of the distance from the path')
    goal_distance_bias: Weight = param(24.0, 'weight of the distance from the goal')
    occdist_scale: Weight = param(0.01, 'weight of the cost under the robot')
    twirling_scale: Weight = param(0.0, 'weight of turning')
    forward_point_distance: Offset_m = param(
        0.325, 'from the centre of the robot to the point that is scored ahead of it [m]'
    )
    cheat_factor: Weight = param(
        1.0, 'that point is scored only farther from the goal than forward_point_distance times the square root of this'
    )
    sum_scores: bool = param(False, 'sum the cost under the robot along a trajectory; false: its maximum')
    oscillation_reset_dist: Distance_m = param(0.05, 'travel that allows the opposite direction again [m]')
    oscillation_reset_angle: Turn_rad = param(0.2, 'turn that allows the opposite direction again [rad]')
    twist_sigmas: Weight = param(
        0.0,
        "use the last command for the velocity if it is within this number of standard deviations of odometry's "
        'twist; 0: never, as upstream',
    )
    latch_margin: Annotated[float, Between(0.0, 0.9)] = param(
        0.0, 'fraction of xy_goal_tolerance to be inside of it before it is latched; 0: none, as upstream'
    )
    stop: Literal['latch', 'precise'] = param(
        'latch',
        'latch: anywhere within the tolerances, as upstream; precise: within them, go on to the place '
        'nearest to the goal and to the middle of yaw_goal_tolerance',
    )
    turn_to_path_angle: Annotated[float, Between(0.0, 3.2, 'rad')] = param(
        2.0, 'turn in place towards a plan that begins at a larger angle than this [rad]; 0: never, as upstream'
    )
    prune_plan: bool = param(True, 'drop the part of the plan behind the robot')

    stop_time_buffer: Duration_s = param(0.2, 'accepted, without effect, as upstream [s]')
    scaling_speed: Speed_mps = param(0.25, 'accepted, without effect, as upstream [m/s]')
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
        if self._most_points() > MOST_POINTS:
            raise ValueError(
                f'vx_samples, vth_samples, sim_time and granularities of no more than {MOST_POINTS:,} points in all'
            )
        return self

    def _most_points(self) -> float:
        """Return how many points the trajectories of one control period have at most."""
        speed_mps = min(self.max_vel_trans, max(abs(self.min_vel_x), abs(self.max_vel_x)))
        steps = self.sim_time * max(speed_mps / self.sim_granularity, self.max_vel_theta / self.angular_sim_granularity)
        return self.vx_samples * self.vth_samples * steps

    def can_start(self, control_period_s: float) -> bool:
        """Return whether a standing robot has any sample that passes min_vel_trans and min_vel_theta.

        With use_dwa the window of one period must reach one of them, else upstream's planner rejects all samples
        forever.
        """
        if not self.use_dwa:
            return True
        change_mps = self.acc_lim_x * control_period_s
        fastest_mps = max(min(self.max_vel_x, change_mps), -max(self.min_vel_x, -change_mps))
        fastest_radps = min(self.max_vel_theta, self.acc_lim_theta * control_period_s)
        return fastest_mps >= self.min_vel_trans or fastest_radps >= self.min_vel_theta
