"""A kinematic robot with a laser in a world of boxes and cylinders: closed loops for the tests."""

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_inputs import OdometrySample
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.simulation.lidar import cast_rays
from diff_encoder_sim.simulation.world import Box, Cylinder, load_world
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from places import WORLDS

LASER_IN_BASE = Pose2D(0.12, 0.0, 0.0)
TICK_S, TICK_NS = 0.01, 10_000_000
RAYS, RANGE_MIN_M, RANGE_MAX_M = 360, 0.15, 6.0
WHEEL_RADIUS_M, WHEEL_SEPARATION_M = 0.1, 0.4

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
    """Table 2 and the defaults, with changes."""
    return NavigatorParams.from_mapping({'DWAPlannerROS': {**TABLE_2, **(dwa or {})}, **changes}, '')


class Shapes(NamedTuple):
    """A world as seen from above."""

    segments: np.ndarray  # (n, 4) x0, y0, x1, y1 of the boxes' sides [m]
    circles: np.ndarray  # (n, 3) x, y, radius [m]
    boxes: np.ndarray  # (n, 5) x, y, yaw, half length, half width

    def contain(self, points):
        """(n,) whether points (n, 2) lie in a solid."""
        inside = np.zeros(len(points), bool)
        for x, y, yaw, half_length, half_width in self.boxes:
            offset = points - (x, y)
            along = offset @ (math.cos(yaw), math.sin(yaw))
            across = offset @ (-math.sin(yaw), math.cos(yaw))
            inside |= (np.abs(along) <= half_length) & (np.abs(across) <= half_width)
        for x, y, radius in self.circles:
            inside |= np.hypot(points[:, 0] - x, points[:, 1] - y) <= radius
        return inside

    def with_box(self, x, y, length, width, yaw=0.0):
        """The same and one box more."""
        return shapes_of(np.vstack([self.boxes, [[x, y, yaw, length / 2, width / 2]]]), self.circles)


def shapes_of(boxes, circles):
    """Shapes of boxes (n, 5) and circles (n, 3)."""
    segments = []
    for x, y, yaw, half_length, half_width in boxes:
        corners = [
            Pose2D(x, y, yaw).compose(Pose2D(sx * half_length, sy * half_width, 0.0))[:2]
            for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1))
        ]
        segments += [[*corners[i], *corners[(i + 1) % 4]] for i in range(4)]
    return Shapes(
        np.array(segments, float).reshape(-1, 4),
        np.array(circles, float).reshape(-1, 3),
        np.array(boxes, float).reshape(-1, 5),
    )


def read_shapes(name):
    """Shapes of a world file."""
    boxes, circles = [], []
    for solid in load_world(WORLDS / f'{name}.world').solids:
        x, y = solid.pose_in_world[:2, 3]
        if isinstance(solid.shape, Box):
            yaw = math.atan2(solid.pose_in_world[1, 0], solid.pose_in_world[0, 0])
            boxes.append([x, y, yaw, solid.shape.size_xyz_m[0] / 2, solid.shape.size_xyz_m[1] / 2])
        elif isinstance(solid.shape, Cylinder):
            circles.append([x, y, solid.shape.radius_m])
    return shapes_of(boxes, circles)


def rasterise(shapes, low, high, resolution_m=0.05):
    """The map of a world between two corners (x, y): occupied where a solid touches a cell."""
    columns, rows = (math.ceil((upper - lower) / resolution_m) for lower, upper in zip(low, high))
    cells = np.full((rows, columns), FREE, np.int8)
    for x_fraction, y_fraction in ((a, b) for a in (0.02, 0.5, 0.98) for b in (0.02, 0.5, 0.98)):
        x, y = np.meshgrid(
            low[0] + (np.arange(columns) + x_fraction) * resolution_m,
            low[1] + (np.arange(rows) + y_fraction) * resolution_m,
        )
        inside = shapes.contain(np.column_stack([x.ravel(), y.ravel()]))
        cells[inside.reshape(cells.shape)] = OCCUPIED
    return OccupancyGrid(cells, resolution_m, Pose2D(*low, 0.0))


def walled_room():
    """A room of 6 x 4 m inside around the origin, and its map."""
    shapes = shapes_of(
        [[0, 2.1, 0, 3.2, 0.1], [0, -2.1, 0, 3.2, 0.1], [3.1, 0, 0, 0.1, 2.2], [-3.1, 0, 0, 0.1, 2.2]], []
    )
    return shapes, rasterise(shapes, (-3.5, -2.5), (3.5, 2.5))


BEARINGS_RAD = 2.0 * math.pi * np.arange(RAYS) / RAYS


class Robot:
    """Unicycle with acceleration limits, encoders of `ppr` pulses (None: ideal) and a laser."""

    def __init__(self, shapes, start, ppr=None, seed=0):
        self.shapes, self.pose = shapes, start
        self.now_ns = 0
        self.linear, self.angular = 0.0, 0.0
        self._start, self._ppr = start, ppr
        self._random = np.random.default_rng(seed)
        self._wheels = self._random.uniform(0.0, 2.0 * math.pi, 2)
        self._odometry = WheelOdometry(OdometryParams.from_mapping({'ppr': ppr or 1}, ''))
        self.base_in_odom = IDENTITY
        xs, ys = np.linspace(-0.25, 0.25, 26), np.linspace(-0.3, 0.3, 31)
        self._outline = np.vstack(
            [np.column_stack([xs, np.full_like(xs, side)]) for side in (-0.3, 0.3)]
            + [np.column_stack([np.full_like(ys, side), ys]) for side in (-0.25, 0.25)]
        )

    def drive(self, command, ticks):
        """Follow a command for some ticks of 10 ms."""
        for _ in range(ticks):
            self.linear += np.clip(command.linear_mps - self.linear, -1.5 * TICK_S, 1.5 * TICK_S)
            self.angular += np.clip(command.angular_radps - self.angular, -6 * TICK_S, 6 * TICK_S)
            self.pose = move_along_arc(self.pose, self.linear * TICK_S, self.angular * TICK_S)
            half = 0.5 * WHEEL_SEPARATION_M * self.angular
            self._wheels += np.array([self.linear - half, self.linear + half]) * TICK_S / WHEEL_RADIUS_M
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
        """map->odom of a perfect localization."""
        return IDENTITY.compose(self.pose).compose(self.base_in_odom.inverse())

    def scan(self, sigma_m=0.03):
        """Scan of the laser, with noise."""
        laser = self.pose.compose(LASER_IN_BASE)
        bearings_rad = laser.yaw_rad + BEARINGS_RAD
        ranges = cast_rays(laser.x_m, laser.y_m, bearings_rad, self.shapes.segments, self.shapes.circles)
        ranges[ranges > RANGE_MAX_M] = np.inf
        ranges += self._random.normal(0.0, sigma_m, RAYS)
        return Scan(self.now_ns, 0.0, 2.0 * math.pi / RAYS, RANGE_MIN_M, RANGE_MAX_M, ranges)

    def touches(self):
        """Whether the true outline is in a solid."""
        cos_yaw, sin_yaw = math.cos(self.pose.yaw_rad), math.sin(self.pose.yaw_rad)
        outline = self._outline @ np.array([[cos_yaw, sin_yaw], [-sin_yaw, cos_yaw]])
        return bool(self.shapes.contain(outline + (self.pose.x_m, self.pose.y_m)).any())


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
        self.touched = self.touched or robot.touches()
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
