"""Mapping drives through the shipped worlds, for tests and benchmark of SLAM."""

import math
import time
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trajectory_error import Alignment, pairs_error
from diff_encoder_sim.localization.grid_slam import GridSlam
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.simulation.state import TICK_S
from diff_encoder_sim.simulation.world import World
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from map_accuracy import map_accuracy, true_surface, visible_points
from places import ROOT

PPRS = (40, 90, 1024, 4096)
SCAN_TICKS, CONTROL_TICKS = 10, 5
# For a scanner with 1 to 3 cm of noise; the rest are slam_gmapping's defaults.
MAPPING = load_yaml(ROOT / 'config' / 'slam.yaml')


class Tour(NamedTuple):
    """Where to drive: towards points, or by a script."""

    world: str
    start: Pose2D
    points: List[Tuple[float, float]]
    script: Optional[ScriptedDrive] = None


class Drive(NamedTuple):
    """What was recorded: one entry of each list for each scan."""

    world: World
    scan_height_m: float
    laser_pose_in_base: Pose2D
    true_poses: List[Pose2D]  # base in the world
    odometry: Dict[str, List[Pose2D]]  # 'ideal' or the PPR: base in odom
    scans: Dict[str, List[Scan]]  # 'fine' with 1 cm of noise, 'coarse' with 3 cm


HALLWAY = Tour('hallway', Pose2D(-10.0, 0.0, 0.0), [(14.0, 0.0), (-14.0, 0.0), (-10.0, 0.0)])
X_M = [-1.9, 0.0, 2.7, 2.8, 2.3, -2.3, -2.8, 0.0, 0.935, 0.935, -2.3, -3.0, -1.9]
Y_M = [-0.935, -0.935, -0.935, 0.935, 2.7, 2.7, 0.935, 0.935, 0.0, -2.7, -2.7, -1.4, -0.935]
ROS_LOGO = Tour('ros_logo', Pose2D(-3.4, -0.85, 0.0), list(zip(X_M, Y_M)))


def shipped_tour(world: str) -> Tour:
    """The tour of config/mapping that mapping.launch drives."""
    test = load_params(TestDefinition, ROOT / 'config' / 'mapping' / f'{world}.yaml')
    return Tour(world, test.start.pose(), [], ScriptedDrive(test))


def record(tour: Tour, pprs: Sequence[int] = PPRS, seed: int = 1) -> Drive:
    """Drive a tour with ideal odometry, some encoders and both scanners on board."""
    simulator = Simulator(
        ROOT / 'worlds' / f'{tour.world}.world', ROOT / 'urdf' / 'alto.urdf.xacro', SimulatorParams(), tour.start, seed
    )
    wheels, lidars, height_m = {}, {}, simulator._scan_height_m
    for ppr in pprs:
        wheels[f'{ppr}'] = ReportingEncoder(EncoderParams(ppr=ppr)), WheelOdometry(OdometryParams(ppr=ppr))
    for name, noise_m in (('fine', 0.01), ('coarse', 0.03)):
        random = generator(seed, f'{name} scans')
        lidars[name] = Lidar(simulator.world, height_m, LidarParams(noise=noise_m), random)
    recorded = [], {name: [] for name in ('ideal', *wheels)}, {name: [] for name in lidars}
    drive = Drive(simulator.world, height_m, simulator.laser_pose_in_base, *recorded)
    points, tick, is_over = list(tour.points), 0, False
    while not is_over:
        pose = simulator.base_pose_in_world()
        for name, (encoder, odometry) in wheels.items():
            for sample in encoder.update(*simulator.joint_states()[:3]):
                estimate = odometry.update(*sample)
                if tick % SCAN_TICKS == 0:
                    drive.odometry[name].append(estimate.base_pose_in_odom)
        if tick % SCAN_TICKS == 0:
            drive.true_poses.append(pose)
            drive.odometry['ideal'].append(pose.relative_to(tour.start))
            laser_pose = pose.compose(simulator.laser_pose_in_base)
            for name, lidar in lidars.items():
                drive.scans[name].append(lidar.scan(simulator.time_ns, laser_pose))
        if tick % CONTROL_TICKS == 0:
            if tour.script:
                simulator.command(*tour.script.command(TICK_S * tick, TICK_S * (tick + CONTROL_TICKS)))
                is_over = tour.script.is_over(TICK_S * tick)
            elif math.hypot(points[0][0] - pose.x_m, points[0][1] - pose.y_m) < 0.35:
                points.pop(0)
            if points:
                simulator.command(*_command_towards(points[0], pose))
            is_over = is_over or not (points or tour.script)
        simulator.tick()
        tick += 1
    simulator.close()
    return drive


def _command_towards(point: Tuple[float, float], pose: Pose2D) -> Tuple[float, float]:
    """Speed [m/s] and turn rate [rad/s]: ahead on a curve, on the spot where it is behind."""
    off_rad = wrap_angle(math.atan2(point[1] - pose.y_m, point[0] - pose.x_m) - pose.yaw_rad)
    return (0.45 if abs(off_rad) < 0.6 else 0.0), float(np.clip(2.0 * off_rad, -1.0, 1.0))


class Case:
    """A drive through a world, and what of the world could be seen."""

    def __init__(self, tour: Tour, pprs: Sequence[int] = PPRS, seed: int = 1):
        self.drive = drive = record(tour, pprs, seed)
        self.surface = true_surface(drive.world, drive.scan_height_m, *tour.start[:2])
        lasers = [pose.compose(drive.laser_pose_in_base) for pose in drive.true_poses]
        bearings_rad = drive.scans['fine'][0].bearings_rad()
        self.visible = visible_points(drive.world, drive.scan_height_m, self.surface, lasers, bearings_rad, 6.0)

    def map(self, odometry: str, scans: str, seed: int = 1, **changes):
        """Accuracy of the map, error of the path, the mapper, its processor time [s], and (2,) the path's bias [m]."""
        slam = GridSlam(GridSlamParams(**{**MAPPING, **changes}), np.random.default_rng(seed), self.drive.true_poses[0])
        true, spent_s = [], 0.0
        for pose, odom_pose, scan in zip(self.drive.true_poses, self.drive.odometry[odometry], self.drive.scans[scans]):
            began_s = time.process_time()
            estimate = slam.update(odom_pose, scan, self.drive.laser_pose_in_base)
            spent_s += time.process_time() - began_s
            if estimate is not None:
                true.append(pose)
        path = [step.base_pose_in_map for step in slam.trajectory]
        grid = slam.map()
        accuracy = map_accuracy(grid, true[0].compose(path[0].inverse()), self.surface, self.visible, grid.resolution_m)
        error = pairs_error([np.hstack((path, true))], Alignment.ORIGIN)
        bias_m = np.subtract(path, true)[:, :2].mean(axis=0)  # both begin at the same pose
        return accuracy, error, slam, spent_s, bias_m
