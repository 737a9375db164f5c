"""Costmaps, plans and closed loops in which navigation is tested: a kinematic robot among boxes and cylinders."""

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_inputs import Command, OdometrySample
from diff_encoder_sim.navigation.navigator_params import DwaParams, NavigatorParams
from diff_encoder_sim.simulation.lidar import cast_rays, cut_world
from diff_encoder_sim.simulation.world import load_world
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from places import WORLDS

PERIOD_S = 0.05
FEW_RAYS, FEW_STEP_RAD = 200, 2.0 * math.pi / 200
LASER_IN_BASE = Pose2D(0.12, 0.0, 0.0)
TICK_S, TICK_NS = 0.01, 10_000_000
RAYS, RANGE_MIN_M, RANGE_MAX_M = 360, 0.15, 6.0

# Table 2 of the paper. A standing robot must reach min_vel_trans in one period: 0.7 m/s^2 over 50 ms.
TABLE_2 = {
    'max_vel_x': 0.45,
    'max_vel_trans': 0.45,
    'min_vel_trans': 0.0,
    'max_vel_theta': 1.0,
    'min_vel_theta': 0.2,
    'acc_lim_x': 0.7,
    'acc_lim_theta': 4.9,
    'xy_goal_tolerance': 0.05,
    'yaw_goal_tolerance': 0.052,
    'goal_distance_bias': 15.0,
    'path_distance_bias': 20.0,
    'latch_xy_goal_tolerance': True,
}


def navigator_params(dwa=None, **changes):
    return NavigatorParams.from_mapping({'DWAPlannerROS': {**TABLE_2, **(dwa or {})}, **changes}, '')


class Shapes(NamedTuple):
    """A world as seen from above."""

    segments: np.ndarray  # (n, 4) x0, y0, x1, y1 of walls [m]
    circles: np.ndarray  # (n, 3) x, y, radius [m]

    def with_box(self, x, y, length, width):
        return Shapes(np.vstack([self.segments, _sides(x, y, length, width)]), self.circles)

    def touch(self, pose):
        bearings_rad = (np.arange(720) + 0.5) * math.pi / 360
        outline_m = np.minimum(0.25 / np.abs(np.cos(bearings_rad)), 0.3 / np.abs(np.sin(bearings_rad)))
        yaws_rad = pose.yaw_rad + bearings_rad
        return bool((cast_rays(pose.x_m, pose.y_m, yaws_rad, *self) < outline_m).any())


def _sides(x, y, length, width):
    corners = np.array([x, y]) + np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (length / 2, width / 2)
    return np.hstack([corners, np.roll(corners, -1, axis=0)])


def shipped_world(name):
    shapes = cut_world(load_world(WORLDS / f'{name}.world'), 0.3)
    return Shapes(*shapes), load_map(WORLDS / f'{name}.yaml')


def walled_room():
    """A room of 6 x 4 m inside around the origin, and its map."""
    cells = np.full((100, 140), OCCUPIED, np.int8)
    cells[10:-10, 10:-10] = FREE
    return Shapes(_sides(0.0, 0.0, 6.0, 4.0), np.empty((0, 3))), OccupancyGrid(cells, 0.05, Pose2D(-3.5, -2.5, 0.0))


class Robot:
    """Unicycle with acceleration limits, encoders of `ppr` pulses (None: ideal) and a laser; commands may be late."""

    def __init__(self, shapes, start, ppr=None, seed=0, speed_mps=0.0, latency_ticks=0):
        self.shapes, self.pose = shapes, start
        self.now_ns = 0
        self.linear, self.angular = speed_mps, 0.0
        self._late = [Command(speed_mps, 0.0)] * latency_ticks
        self._start, self._ppr = start, ppr
        self._random = np.random.default_rng(seed)
        self._wheels = self._random.uniform(0.0, 2.0 * math.pi, 2)
        self._odometry = WheelOdometry(OdometryParams.from_mapping({'ppr': ppr or 1}, ''))
        self.base_in_odom = IDENTITY

    def drive(self, command, ticks):
        """Follow a command for some ticks of 10 ms."""
        for _ in range(ticks):
            self._late.append(command)
            command_now = self._late.pop(0)
            self.linear += np.clip(command_now.linear_mps - self.linear, -1.5 * TICK_S, 1.5 * TICK_S)
            self.angular += np.clip(command_now.angular_radps - self.angular, -6 * TICK_S, 6 * TICK_S)
            self.pose = move_along_arc(self.pose, self.linear * TICK_S, self.angular * TICK_S)
            # Wheels of radius 0.1 m, 0.4 m apart.
            speeds_mps = np.array([self.linear - 0.2 * self.angular, self.linear + 0.2 * self.angular])
            self._wheels += speeds_mps * TICK_S / 0.1
            self.now_ns += TICK_NS

    def odometry(self):
        """Base pose in odom, twist and its standard deviations, as measured now; call at 20 Hz."""
        if self._ppr is None:
            self.base_in_odom = IDENTITY.compose(self.pose.relative_to(self._start))
            return self.base_in_odom, self.linear, self.angular
        counts = np.floor(self._wheels * self._ppr / (2.0 * math.pi)).astype(int).tolist()
        estimate = self._odometry.update(self.now_ns, *counts)
        self.base_in_odom = estimate.base_pose_in_odom
        return (self.base_in_odom, estimate.linear_velocity_mps, estimate.angular_velocity_radps, *estimate.twist_std())

    def localization(self):
        return IDENTITY.compose(self.pose).compose(self.base_in_odom.inverse())

    def scan(self, sigma_m=0.03):
        laser = self.pose.compose(LASER_IN_BASE)
        bearings_rad = 2.0 * math.pi * np.arange(RAYS) / RAYS
        ranges = cast_rays(laser.x_m, laser.y_m, laser.yaw_rad + bearings_rad, *self.shapes)
        ranges[ranges > RANGE_MAX_M] = np.inf
        ranges += self._random.normal(0.0, sigma_m, RAYS)
        return Scan(self.now_ns, 0.0, 2.0 * math.pi / RAYS, RANGE_MIN_M, RANGE_MAX_M, ranges)


class ClosedLoop:
    """A robot and its navigator, period by period."""

    def __init__(self, shapes, grid, start, ppr=None, seed=0, params=None):
        self.robot = Robot(shapes, start, ppr, seed)
        self.navigator = Navigator(params or navigator_params(), grid, LASER_IN_BASE)
        self.period = 0
        self.muted = set()  # inputs that do not arrive: 'odometry', 'localization', 'scan'
        self.outputs, self.trace, self.touched = [], [], False

    def step(self):
        """One control period of 50 ms; scan and localization come in every second one."""
        robot, navigator = self.robot, self.navigator
        odometry = robot.odometry()
        if 'odometry' not in self.muted:
            navigator.take_odometry(OdometrySample(robot.now_ns, *odometry))
        if self.period % 2 == 0:
            if 'localization' not in self.muted:
                navigator.take_localization(robot.now_ns, robot.localization())
            if 'scan' not in self.muted:
                navigator.take_scan(robot.scan())
        output = navigator.step(robot.now_ns)
        robot.drive(output.command, 5)
        self.touched = self.touched or robot.shapes.touch(robot.pose)
        self.outputs.append(output)
        self.trace.append(robot.pose)
        self.period += 1
        return output

    def run(self, limit_s):
        """Until the goal is over or time is up; returns the last output."""
        for _ in range(int(limit_s * 20)):
            output = self.step()
            if output.status.is_over:
                break
        return output


def dwa_params(**changes):
    return DwaParams.from_mapping({**TABLE_2, **changes}, '')


def static_costmap(cells, origin=IDENTITY, **params):
    return Costmap(CostmapParams.from_mapping(params, ''), OccupancyGrid(np.asarray(cells, np.int8), 0.05, origin))


def scan_of(ranges_by_degree, rays=360):
    ranges = np.full(rays, np.nan)
    ranges[list(ranges_by_degree)] = list(ranges_by_degree.values())
    return Scan(0, 0.0, math.radians(1.0), 0.15, 6.0, ranges)


def local_costmap(marked=(), **params):
    """A window around (0, 0), with lethal cells at points (x, y) [m]."""
    costmap = Costmap(local_defaults(**params))
    for x, y in marked:
        costmap._obstacles[costmap.cell_at(x, y)] = 254
    return costmap


def seen_costmap(random, **params):
    """A window around (0, 0) that has seen a scan of obstacles at random distances."""
    costmap = Costmap(local_defaults(inflation_radius=0.8, cost_scaling_factor=3.0, **params))
    ranges_m = np.where(random.random(FEW_RAYS) < 0.03, random.uniform(0.45, 1.5, FEW_RAYS), math.inf)
    costmap.update(IDENTITY, Scan(0, 0.0, FEW_STEP_RAD, 0.15, 6.0, ranges_m), IDENTITY)
    return costmap


def straight_plan(length_m=1.4, bearing_rad=0.0):
    distance_m = np.arange(0.0, length_m + 1e-9, 0.025)
    return distance_m[:, None] * (math.cos(bearing_rad), math.sin(bearing_rad), 0.0) + (0.0, 0.0, bearing_rad)


def winding_plan(random, points=60):
    yaws_rad = random.uniform(-3.0, 3.0) + np.cumsum(random.normal(0.0, 0.15, points))
    steps_m = 0.025 * np.column_stack([np.cos(yaws_rad), np.sin(yaws_rad)])
    return np.column_stack([random.uniform(-0.05, 0.05, 2) + np.cumsum(steps_m, axis=0), yaws_rad])
