"""The simulated robot: commands in, joint states and true pose out, on its own clock."""

from __future__ import annotations

import math
from pathlib import Path
from typing import List, Optional, Union

import numpy as np
from pydantic import Field, field_validator

from diff_encoder_sim.base.bounded_numbers import LengthOrZero_m
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, yaw_from_quat_xyzw
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.robots.proposed_laser import proposed_laser_line
from diff_encoder_sim.robots.robot_choices import RobotChoices
from diff_encoder_sim.robots.robot_description import RobotDescription
from diff_encoder_sim.robots.robot_source import RobotSource
from diff_encoder_sim.robots.simulated_robot import load_simulated_robot
from diff_encoder_sim.simulation.drive import DriveController, DriveParams
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.periods import TICK_NS, TICK_S
from diff_encoder_sim.simulation.physics import BulletPhysics, PhysicsParams
from diff_encoder_sim.simulation.state import AT_REST, BodyState, JointStates, PlanarVelocity
from diff_encoder_sim.simulation.wheel_errors import SlippingWheels, WheelErrorParams
from diff_encoder_sim.simulation.world import load_world


class SimulatorParams(Params):
    """Parameters of the simulated robot."""

    left_joint: str = Field('left_wheel_joint', min_length=1, description='joint of the left wheel in the robot file')
    right_joint: str = Field(
        'right_wheel_joint', min_length=1, description='joint of the right wheel in the robot file'
    )
    laser_link: str = Field(
        'laser', min_length=1, description='link of the LiDAR in the robot file, and frame of its scans'
    )
    wheel_diameter: LengthOrZero_m = Field(0.0, description='nominal one of the robot [m]; 0: as in the robot file')
    wheel_separation: LengthOrZero_m = Field(
        0.0, description='between the contact points, nominal one of the robot [m]; 0: as in the robot file'
    )
    drive: DriveParams = Field(DriveParams(), description='motors and their controller')
    lidar: LidarParams = Field(LidarParams(), description='LiDAR')
    physics: PhysicsParams = Field(PhysicsParams(), description='settings of PyBullet')
    wheel_errors: WheelErrorParams = Field(WheelErrorParams(), description='errors of the wheels')

    def choices(self) -> RobotChoices:
        """Return what these parameters say about the robot."""
        diameter_m, separation_m = self.wheel_diameter or None, self.wheel_separation or None
        return RobotChoices(self.left_joint, self.right_joint, self.laser_link or None, diameter_m, separation_m)

    @field_validator('lidar')
    @classmethod
    def _check_scan_period(cls, lidar: LidarParams) -> LidarParams:
        if lidar.period_ns % TICK_NS:
            raise ValueError(f'a rate whose period is whole {TICK_NS // 1_000_000} ms')
        return lidar


class Simulator:
    """One robot in one world, advanced tick by tick (10 ms). Same seed, same numbers."""

    def __init__(
        self,
        world_file: Union[str, Path],
        robot: Union[str, Path, RobotSource],
        params: SimulatorParams,
        start_pose: Pose2D,
        seed: int,
    ) -> None:
        """Load both files and put the robot, at rest, at `start_pose` of the world.

        The wheels' initial angles are drawn from the seed: without this, every trial would repeat
        the same quantisation error.

        Raises:
            ConfigError: a file is missing or malformed.
        """
        self.params = params
        self.world = load_world(world_file)
        source = robot if isinstance(robot, RobotSource) else RobotSource(Path(robot))
        geometry = params.wheel_errors.geometry(generator(seed, 'wheel_geometry'))
        self._robot = load_simulated_robot(source, params.choices(), geometry)
        self._joints, self._forward_signs = self._robot.joints, self._robot.forward_signs
        description = self._robot.description
        laser_pose = _laser_pose_in_root(description)
        self.laser_pose_in_base = _in_plane(laser_pose)
        self._laser_above_base_m = float(laser_pose[2, 3])
        self._start_pose, self._seed = start_pose, seed
        radius_m = 0.5 * description.wheel_diameter_m
        self._controller = DriveController(params.drive, radius_m, description.wheel_separation_m)
        self._physics = self._new_physics()
        self._begin()

    @property
    def robot_name(self) -> str:
        """The robot's name in its URDF."""
        return self._robot.description.tree.name

    def close(self) -> None:
        """Free the physics; the object cannot be used afterwards."""
        self._physics.close()

    def reset(self) -> None:
        """Restore the state of the beginning, time and wheel angles included."""
        self.close()
        self._controller.reset()
        self._physics = self._new_physics()
        self._begin()

    def _new_physics(self) -> BulletPhysics:
        params = self.params
        return BulletPhysics(self.world, self._robot, self._start_pose, params.drive.wheel_torque, params.physics)

    def _begin(self) -> None:
        """Set time to 0, and draw what differs from trial to trial from the seed."""
        self.time_ns = 0
        phases_rad = generator(self._seed, 'wheel_phase').uniform(0.0, 2.0 * math.pi, 2)
        self._phases_rad: List[float] = phases_rad.tolist()
        # base_link may be at the floor, where ALTO's is, or at the axle.
        self._scan_height_m = self._physics.base_pose()[0][2] + self._laser_above_base_m
        self._lidar = Lidar(self.world, self._scan_height_m, self.params.lidar, generator(self._seed, 'lidar_noise'))
        self._wheels = SlippingWheels(
            self.params.wheel_errors,
            (self._robot.wheels.left_radius_m, self._robot.wheels.right_radius_m),
            generator(self._seed, 'wheel_slip'),
        )
        self._read_wheels()

    def reset_world(self) -> None:
        """Put the robot back at its start; time and wheel angles continue."""
        self._controller.reset()
        self._physics.place(self._start_pose)

    def place(self, base_pose_in_world: Pose2D, base_velocity_in_world: PlanarVelocity = AT_REST) -> None:
        """Put the robot at another pose; time, wheel angles and the command continue.

        The encoder does not measure it: the kidnapped robot problem.
        """
        self._physics.place(base_pose_in_world, base_velocity_in_world)

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Command a velocity of base_link.

        Raises:
            InputFault: the command is not finite.
        """
        self._controller.command(self.time_ns, linear_mps, angular_radps)

    def tick(self) -> None:
        """Advance by 10 ms."""
        speeds = self._controller.wheel_speeds_radps(self.time_ns, TICK_S)
        self._physics.tick(*self._wheels.rolling_speeds(*speeds))
        self.time_ns += TICK_NS
        self._read_wheels()

    def joint_states(self) -> JointStates:
        """Return the wheels' angles (phase included) and speeds, as ideal sensors of the robot's joints."""
        left, right = self._forward_signs
        (left_rad, right_rad), (left_radps, right_radps) = self._angles_rad, self._speeds_radps
        return JointStates(
            self.time_ns, self._joints, (left * left_rad, right * right_rad), (left * left_radps, right * right_radps)
        )

    def base(self) -> BodyState:
        """Return the true state of base_link in the world frame."""
        return self._physics.base()

    def base_pose_in_world(self) -> Pose2D:
        """Return the true pose of base_link in the plane of the world frame."""
        (x_m, y_m, _), quat_xyzw = self._physics.base_pose()
        return Pose2D(x_m, y_m, yaw_from_quat_xyzw(*quat_xyzw))

    def scan(self) -> Scan:
        """Take a scan from the LiDAR's true pose."""
        return self._lidar.scan(self.time_ns, self.base_pose_in_world().compose(self.laser_pose_in_base))

    def obstacle_hit(self) -> Optional[str]:
        """Return the name of a solid, other than the floor, that the robot touches now, if any."""
        return self._physics.obstacle_hit()

    def _read_wheels(self) -> None:
        rolled = self._physics.wheels()
        turned_rad = self._wheels.turned(rolled.angles_rad)
        self._angles_rad = self._phases_rad[0] + turned_rad[0], self._phases_rad[1] + turned_rad[1]
        self._speeds_radps = self._wheels.turning_speeds(*rolled.speeds_radps)


def _laser_pose_in_root(description: RobotDescription) -> np.ndarray:
    """Return the scanner's (4, 4) pose, which is upright.

    Raises:
        ConfigError: the robot has none.
    """
    if description.laser is None:
        raise ConfigError(
            f'{description.tree.where}: no laser is found; allowed: simulator.laser_link, a link of the file, or '
            f'{proposed_laser_line(description)}'
        )
    return description.laser.pose_in_root


def _in_plane(pose: np.ndarray) -> Pose2D:
    x_m, y_m = pose[:2, 3].tolist()
    return Pose2D(x_m, y_m, math.atan2(pose[1, 0], pose[0, 0]))
