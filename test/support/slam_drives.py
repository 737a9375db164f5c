"""Mapping drives through the shipped worlds, for tests and benchmark of SLAM."""

import math
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trajectory_error import Alignment, pairs_error
from diff_encoder_sim.localization.grid_slam import GridSlam
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.simulation.state import TICK_S
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from map_accuracy import map_accuracy, true_surface, visible_points
from places import ROOT

SCAN_TICKS, CONTROL_TICKS = 10, 5
# For a scanner with 1 to 3 cm of noise; the rest are slam_gmapping's defaults.
MAPPING = load_yaml(ROOT / 'config' / 'slam.yaml')


class Tour(NamedTuple):
    """Where to drive: towards points, or by a script."""

    world: str
    start: Pose2D
    points: List[Tuple[float, float]]
    script: Optional[ScriptedDrive] = None


HALLWAY = Tour('hallway', Pose2D(-10.0, 0.0, 0.0), [(14.0, 0.0), (-14.0, 0.0), (-10.0, 0.0)])
X_M = [-1.9, 0.0, 2.7, 2.8, 2.3, -2.3, -2.8, 0.0, 0.935, 0.935, -2.3, -3.0, -1.9]
Y_M = [-0.935, -0.935, -0.935, 0.935, 2.7, 2.7, 0.935, 0.935, 0.0, -2.7, -2.7, -1.4, -0.935]
ROS_LOGO = Tour('ros_logo', Pose2D(-3.4, -0.85, 0.0), list(zip(X_M, Y_M)))


def shipped_tour(world: str) -> Tour:
    """The tour of config/mapping that mapping.launch drives."""
    test = load_params(TestDefinition, ROOT / 'config' / 'mapping' / f'{world}.yaml')
    return Tour(world, test.start.pose(), [], ScriptedDrive(test))


def _command(tour, points, pose, tick):
    """Speed [m/s] and turn rate [rad/s], None at the end: ahead on a curve, on the spot to points that are behind."""
    if tour.script:
        begin_s, end_s = TICK_S * tick, TICK_S * (tick + CONTROL_TICKS)
        return None if tour.script.is_over(begin_s) else tour.script.command_at(begin_s, end_s - begin_s)
    if math.hypot(points[0][0] - pose.x_m, points[0][1] - pose.y_m) < 0.35:
        points.pop(0)
    if not points:
        return None
    off_rad = wrap_angle(math.atan2(points[0][1] - pose.y_m, points[0][0] - pose.x_m) - pose.yaw_rad)
    return (0.45 if abs(off_rad) < 0.6 else 0.0), float(np.clip(2.0 * off_rad, -1.0, 1.0))


class Case:
    """A drive through a world, and what of the world could be seen; one entry of each list for each scan."""

    def __init__(self, tour: Tour, seed: int = 1):
        files = ROOT / 'worlds' / f'{tour.world}.world', RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')
        simulator = Simulator(*files, SimulatorParams(), tour.start, seed)
        self.world, self.laser_pose_in_base = simulator.world, simulator.laser_pose_in_base
        self.true_poses = []  # base in the world
        self.odometry = {'ideal': [], '40': []}  # base in odom; 40 PPR
        self.scans = {'fine': [], 'coarse': []}  # 1 cm and 3 cm of noise
        encoder, odometry = ReportingEncoder(EncoderParams(ppr=40)), WheelOdometry(OdometryParams(ppr=40))
        height_m, lidars = simulator._scan_height_m, {}
        for name, noise_m in (('fine', 0.01), ('coarse', 0.03)):
            random = generator(seed, f'{name} scans')
            lidars[name] = Lidar(self.world, height_m, LidarParams(noise=noise_m), random)
        points, tick, command = list(tour.points), 0, (0.0, 0.0)
        while command is not None:
            pose = simulator.physics.base_pose_in_plane()
            for sample in encoder.update(*simulator.joint_states()[:3]):
                estimate = odometry.update(*sample)
            if tick % SCAN_TICKS == 0:
                self.true_poses.append(pose)
                self.odometry['ideal'].append(pose.relative_to(tour.start))
                self.odometry['40'].append(estimate.base_pose_in_odom)
                for name, lidar in lidars.items():
                    self.scans[name].append(lidar.scan(simulator.time_ns, pose.compose(self.laser_pose_in_base)))
            if tick % CONTROL_TICKS == 0:
                command = _command(tour, points, pose, tick)
                simulator.command(*(command or (0.0, 0.0)))
            simulator.tick()
            tick += 1
        simulator.close()
        lasers = [pose.compose(self.laser_pose_in_base) for pose in self.true_poses]
        bearings_rad = self.scans['fine'][0].bearings_rad()
        self.surface = true_surface(self.world, height_m, *tour.start[:2])
        self.visible = visible_points(self.world, height_m, self.surface, lasers, bearings_rad, 6.0)

    def map(self, odometry: str, scans: str, seed: int = 1, **changes):
        """Accuracy of the map, error of the path, the mapper, and (2,) the path's bias [m]."""
        slam = GridSlam(GridSlamParams(**{**MAPPING, **changes}), np.random.default_rng(seed), self.true_poses[0])
        true, path = [], []
        for pose, odom_pose, scan in zip(self.true_poses, self.odometry[odometry], self.scans[scans]):
            estimate = slam.update(odom_pose, scan, self.laser_pose_in_base)
            if estimate is not None:
                true.append(pose)
                path.append(estimate.base_pose_in_map)
        grid = slam.map()
        accuracy = map_accuracy(grid, true[0].compose(path[0].inverse()), self.surface, self.visible, grid.resolution_m)
        error = pairs_error([np.hstack((path, true))], Alignment.ORIGIN)
        return accuracy, error, slam, np.subtract(path, true)[:, :2].mean(axis=0)  # both begin at the same pose
