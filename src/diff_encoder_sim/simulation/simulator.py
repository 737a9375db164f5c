"""The simulated robot: commands in, joint states and true pose out, on its own clock."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Optional, Union

import numpy as np
from pydantic import Field, field_validator

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, yaw_from_quat_xyzw
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.simulation.drive import DriveController, DriveParams
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.periods import TICK_NS, TICK_S
from diff_encoder_sim.simulation.physics import BulletPhysics, PhysicsParams
from diff_encoder_sim.simulation.robot import load_robot
from diff_encoder_sim.simulation.state import AT_REST, BodyState, JointStates, PlanarVelocity
from diff_encoder_sim.simulation.wheel_errors import SlippingWheels, WheelErrorParams
from diff_encoder_sim.simulation.world import load_world

# A scanner that leans less is treated as level, as the nodes that read its scans treat it.
LARGEST_LEAN_RAD = math.radians(5.0)


class SimulatorParams(Params):
    """Parameters of the simulated robot."""

    left_joint: str = Field('left_wheel_joint', min_length=1, description='joint of the left wheel in the robot file')
    right_joint: str = Field(
        'right_wheel_joint', min_length=1, description='joint of the right wheel in the robot file'
    )
    laser_link: str = Field(
        'laser', min_length=1, description='link of the LiDAR in the robot file, and frame of its scans'
    )
    drive: DriveParams = Field(DriveParams(), description='motors and their controller')
    lidar: LidarParams = Field(LidarParams(), description='LiDAR')
    physics: PhysicsParams = Field(PhysicsParams(), description='settings of PyBullet')
    wheel_errors: WheelErrorParams = Field(WheelErrorParams(), description='errors of the wheels')

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
        robot_file: Union[str, Path],
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
        self._nominal = load_robot(robot_file, params.left_joint, params.right_joint, {})
        self._true = load_robot(
            robot_file, params.left_joint, params.right_joint, params.wheel_errors.xacro_arguments()
        )
        self._check_errors_took_effect(robot_file)
        laser_pose = self._nominal.link_pose_in_root(params.laser_link)
        self.laser_pose_in_base = _planar_mount(laser_pose, f'{robot_file}: link {params.laser_link!r}')
        self._laser_above_base_m = float(laser_pose[2, 3])
        self._start_pose, self._seed = start_pose, seed
        radius_m = 0.5 * (self._nominal.left_wheel_radius_m + self._nominal.right_wheel_radius_m)
        self._controller = DriveController(params.drive, radius_m, self._nominal.wheel_separation_m)
        self._physics = self._new_physics()
        self._begin()

    @property
    def robot_name(self) -> str:
        """The robot's name in its URDF."""
        return self._nominal.name

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
        return BulletPhysics(self.world, self._true, self._start_pose, params.drive.wheel_torque, params.physics)

    def _begin(self) -> None:
        """Set time to 0, and draw what differs from trial to trial from the seed."""
        self.time_ns = 0
        phases_rad = generator(self._seed, 'wheel_phase').uniform(0.0, 2.0 * math.pi, 2)
        self._phases_rad = tuple(phases_rad.tolist())
        # base_link may be at the floor, where ALTO's is, or at the axle.
        self._scan_height_m = self._physics.base_pose()[0][2] + self._laser_above_base_m
        self._lidar = Lidar(self.world, self._scan_height_m, self.params.lidar, generator(self._seed, 'lidar_noise'))
        self._wheels = SlippingWheels(
            self.params.wheel_errors,
            (self._true.left_wheel_radius_m, self._true.right_wheel_radius_m),
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
        """Return the wheels' angles (phase included) and speeds, as an ideal joint sensor reads them."""
        names = self.params.left_joint, self.params.right_joint
        return JointStates(self.time_ns, names, self._angles_rad, self._speeds_radps)

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
        self._angles_rad = tuple(phase + angle for phase, angle in zip(self._phases_rad, turned_rad))
        self._speeds_radps = self._wheels.turning_speeds(*rolled.speeds_radps)

    def _check_errors_took_effect(self, robot_file: Union[str, Path]) -> None:
        """Refuse a robot file without the xacro arguments, which would silently drop the errors."""
        errors, nominal, true = self.params.wheel_errors, self._nominal, self._true
        for key, true_m, nominal_m in (
            ('left_radius_error', true.left_wheel_radius_m, nominal.left_wheel_radius_m),
            ('right_radius_error', true.right_wheel_radius_m, nominal.right_wheel_radius_m),
            ('wheel_separation_error', true.wheel_separation_m, nominal.wheel_separation_m),
        ):
            wanted_m = nominal_m * (1.0 + getattr(errors, key))
            if not math.isclose(true_m, wanted_m, rel_tol=1e-6):
                raise ConfigError(
                    f'{robot_file}: wheel_errors.{key} has no effect on this robot; '
                    f'allowed: 0, or a xacro file with arguments as alto has them'
                )


def _planar_mount(laser_pose_in_base: np.ndarray, where: str) -> Pose2D:
    """Return a scanner's mount (4, 4) in the plane; `where` names it in the error.

    Raises:
        ConfigError: the scanner leans, or is mounted upside down.
    """
    lean_rad = math.acos(min(1.0, max(-1.0, float(laser_pose_in_base[2, 2]))))
    if lean_rad > LARGEST_LEAN_RAD:
        raise ConfigError(
            f'{where}: leans by {math.degrees(lean_rad):.0f} degrees; allowed: a '
            f'scanner upright within {math.degrees(LARGEST_LEAN_RAD):.0f} degrees'
        )
    x_m, y_m = laser_pose_in_base[:2, 3].tolist()
    return Pose2D(x_m, y_m, math.atan2(laser_pose_in_base[1, 0], laser_pose_in_base[0, 0]))
