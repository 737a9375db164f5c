"""PyBullet behind a narrow interface: one robot on static solids, stepped at a fixed rate.

Step and solver iterations are the outcome of a convergence study: docs/adr/0001-contact-and-step.md,
test/benchmark/physics_convergence.py. Contact shapes are those of robots/simulated_robot.py.
"""

from __future__ import annotations

import math
import tempfile
from itertools import product
from pathlib import Path
from typing import Dict, Iterable, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.robots.simulated_robot import SimulatedRobot
from diff_encoder_sim.simulation.bullet import (
    AHEAD_M,
    LOOK_AGAIN_M,
    STDERR,
    STDOUT,
    NearSolids,
    QuatXyzw,
    add_body,
    add_shape,
    pybullet,
    silence,
)
from diff_encoder_sim.simulation.state import AT_REST, TICK_S, BodyState, PlanarVelocity
from diff_encoder_sim.simulation.world import Plane, World

GRAVITY_MPS2 = 9.81
SETTLING_TICKS = 50
ROOT_LINK = -1
# A wheel that rolls on in one step by less than this part of its radius keeps one contact point; of a faster one, up to
# four are kept, which takes twice the time. Each of several parts of the robot near the floor would be as costly, and
# near a wall the robot would seem to touch it: points farther apart than the other number are left out.
CONTACT_BREAKING, TOUCHING_M = 0.2, 1e-3
LOOK_AGAIN_TICKS = 100  # also where the wheels stand, and the robot slides
SOLVER_RESIDUAL_THRESHOLD = 1e-9  # PyBullet's 1e-7 stops early where there are more iterations

PositionXyz = Tuple[float, float, float]
PoseXyzQuat = Tuple[PositionXyz, QuatXyzw]


class PhysicsParams(Params):
    """Step and iterations of PyBullet."""

    steps_per_tick: Annotated[int, Between(1, 100)] = Field(1, description='physics steps in each 10 ms')
    solver_iterations: Annotated[int, Between(1, 1000)] = Field(50, description='iterations of the contact solver')


class WheelState(NamedTuple):
    """Both wheels' rotation since the start, left then right."""

    angles_rad: Tuple[float, float]
    speeds_radps: Tuple[float, float]


class BulletPhysics:
    """A robot in a world. Equal calls give equal results, bit for bit."""

    def __init__(
        self, world: World, robot: SimulatedRobot, start_pose: Pose2D, wheel_torque_nm: float, params: PhysicsParams
    ) -> None:
        self._wheel_torque_nm = wheel_torque_nm
        self._client = pybullet.connect(pybullet.DIRECT)
        try:
            pybullet.setGravity(0, 0, -GRAVITY_MPS2, physicsClientId=self._client)
            pybullet.setPhysicsEngineParameter(
                fixedTimeStep=TICK_S,
                numSubSteps=params.steps_per_tick,
                numSolverIterations=params.solver_iterations,
                solverResidualThreshold=SOLVER_RESIDUAL_THRESHOLD,
                deterministicOverlappingPairs=1,
                contactBreakingThreshold=CONTACT_BREAKING,
                physicsClientId=self._client,
            )
            floors = [solid for solid in world.solids if isinstance(solid.shape, Plane)]
            obstacles = [solid for solid in world.solids if not isinstance(solid.shape, Plane)]
            self._floors = [add_body(self._client, add_shape(self._client, floor), floor) for floor in floors]
            self._robot = self._load(robot)
            for link in self._links():
                pybullet.changeDynamics(
                    self._robot, link, contactProcessingThreshold=TOUCHING_M, physicsClientId=self._client
                )
            left_joint, right_joint = robot.joints
            joints = self._link_indices(by_joint=True)
            self._wheel_joints = joints[left_joint], joints[right_joint]
            self._floor_only = self._keep_to_floors(robot.floor_only_links)
            self._near = NearSolids(self._client, obstacles, lambda solid: self._filter(solid, self._floor_only))
            self._wheel_radius_m = max(robot.wheels[:2])
            self._driven_m, self._ticks = 0.0, 0  # since the near solids were looked at
            self._tick_m = 0.0  # that the robot may move in a tick: the most of it since then
            self._set_motors(0.0, 0.0)
            dynamics = pybullet.getDynamicsInfo(self._robot, ROOT_LINK, physicsClientId=self._client)
            # base_link's pose in the frame of the root's centre of mass.
            self._base_in_inertial: PoseXyzQuat = pybullet.invertTransform(dynamics[3], dynamics[4])
            self._settle(start_pose, robot.description.floor_z_m)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Free PyBullet's world; the object cannot be used afterwards."""
        if self._client >= 0:
            pybullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def tick(self, left_radps: float, right_radps: float) -> None:
        """Drive the wheels at these speeds, as far as torque allows, for 10 ms."""
        if (left_radps, right_radps) != self._motor_speeds_radps:
            self._set_motors(left_radps, right_radps)
        pybullet.stepSimulation(physicsClientId=self._client)
        self._driven_m += self._tick_m
        self._ticks += 1
        if self._driven_m > LOOK_AGAIN_M or self._ticks >= LOOK_AGAIN_TICKS:
            self._look_around()

    def _set_motors(self, left_radps: float, right_radps: float) -> None:
        """Have the motors keep to speeds, until they are set to others."""
        pybullet.setJointMotorControlArray(
            self._robot,
            self._wheel_joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=(left_radps, right_radps),
            forces=(self._wheel_torque_nm, self._wheel_torque_nm),
            physicsClientId=self._client,
        )
        self._motor_speeds_radps = left_radps, right_radps
        self._tick_m = max(self._tick_m, self._commanded_tick_m())

    def _commanded_tick_m(self) -> float:
        return max(map(abs, self._motor_speeds_radps)) * self._wheel_radius_m * TICK_S

    def wheels(self) -> WheelState:
        """Return the rotation of the wheels against the body since the start."""
        left, right = pybullet.getJointStates(self._robot, self._wheel_joints, physicsClientId=self._client)
        return WheelState(
            (left[0] - self._resting_angles_rad[0], right[0] - self._resting_angles_rad[1]), (left[1], right[1])
        )

    def base(self) -> BodyState:
        """Return the true state of base_link in the world."""
        mass_m, mass_quat = self._inertial_pose()
        base_m, base_quat = pybullet.multiplyTransforms(mass_m, mass_quat, *self._base_in_inertial)
        linear, angular = pybullet.getBaseVelocity(self._robot, physicsClientId=self._client)
        # The velocity of another point of a rigid body: v + w x r.
        x_m, y_m, z_m = (base - mass for base, mass in zip(base_m, mass_m))
        roll_radps, pitch_radps, yaw_radps = angular
        return BodyState(
            base_m,
            base_quat,
            (
                linear[0] + (pitch_radps * z_m - yaw_radps * y_m),
                linear[1] + (yaw_radps * x_m - roll_radps * z_m),
                linear[2] + (roll_radps * y_m - pitch_radps * x_m),
            ),
            angular,
        )

    def base_pose(self) -> PoseXyzQuat:
        """Return the true position [m] and orientation of base_link in the world."""
        pose: PoseXyzQuat = pybullet.multiplyTransforms(*self._inertial_pose(), *self._base_in_inertial)
        return pose

    def place(self, pose: Pose2D, velocity: PlanarVelocity = AT_REST) -> None:
        """Lift the robot to a pose on the floor, moving at a velocity, wheel angles as they are."""
        position, quat = self.base_pose()
        self._place_base((pose.x_m, pose.y_m, position[2]), _turned_to_yaw(quat, pose.yaw_rad), velocity)
        self._look_around()

    def obstacle_hit(self) -> Optional[str]:
        """Return the name of a solid, other than the floor, that the robot touches, if any."""
        names = self._near.names
        if not names:
            return None
        contacts = pybullet.getContactPoints(bodyA=self._robot, physicsClientId=self._client)
        touched = (contact[2] for contact in contacts if contact[2] in names and contact[8] < TOUCHING_M)
        return next(map(names.__getitem__, touched), None)

    def floor_loads(self) -> Dict[str, float]:
        """Return the fraction of the weight on each link, by the joint that it hangs on, that stands on the floor."""
        names = {index: name for name, index in self._link_indices(by_joint=True).items()}
        loads_n: Dict[str, float] = {}
        for contact in pybullet.getContactPoints(bodyA=self._robot, physicsClientId=self._client):
            if contact[2] in self._floors and contact[9] > 0.0:
                name = names.get(contact[3], '')
                loads_n[name] = loads_n.get(name, 0.0) + contact[9]
        # Fractions: PyBullet gives the force of a sub-step over the whole step.
        return {name: load_n / sum(loads_n.values()) for name, load_n in loads_n.items()}

    def is_seen(self, from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
        """Return for (n, 3) points in the world whether a ray from each to another (n, 3) point hits the robot."""
        rays = pybullet.rayTestBatch(from_m.tolist(), to_m.tolist(), physicsClientId=self._client)
        return np.array([ray[0] == self._robot and ray[1] not in self._floor_only for ray in rays])

    def _inertial_pose(self) -> PoseXyzQuat:
        """Return position and orientation of the root's centre of mass, as PyBullet reports them."""
        pose: PoseXyzQuat = pybullet.getBasePositionAndOrientation(self._robot, physicsClientId=self._client)
        return pose

    def _load(self, robot: SimulatedRobot) -> int:
        # Not URDF_MERGE_FIXED_LINKS: it misplaces the centre of mass, and the casters get friction.
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, 'robot.urdf')
            # A line for each tag: PyBullet cuts lines after 8191 characters, in the middle of a number, too.
            file.write_text(robot.urdf.replace('><', '>\n<'), encoding='utf-8')
            try:
                with silence(STDOUT, STDERR):
                    return int(pybullet.loadURDF(str(file), flags=flags, physicsClientId=self._client))
            except pybullet.error:
                raise ConfigError(f'{robot.description.tree.where}: PyBullet cannot load its URDF') from None

    def _links(self) -> range:
        """Return PyBullet's numbers of the robot's links, the root's first."""
        return range(ROOT_LINK, pybullet.getNumJoints(self._robot, physicsClientId=self._client))

    def _link_indices(self, by_joint: bool) -> Dict[str, int]:
        """Return PyBullet's numbers of the robot's links but the root, by their own names or their joints'."""
        infos = [pybullet.getJointInfo(self._robot, link, physicsClientId=self._client) for link in self._links()[1:]]
        return {info[1 if by_joint else 12].decode(): info[0] for info in infos}

    def _keep_to_floors(self, floor_only_links: Sequence[str]) -> Tuple[int, ...]:
        """Keep the other links off floors, if there are links that touch these alone; return PyBullet's numbers.

        Without such links everything touches everything.
        """
        links = self._link_indices(by_joint=False)
        floor_only = tuple(links[name] for name in floor_only_links)
        others = {ROOT_LINK, *links.values()} - {*floor_only} if floor_only else ()
        for floor in self._floors:
            self._filter(floor, others)
        return floor_only

    def _filter(self, body: int, links: Iterable[int]) -> None:
        """Keep links off a body."""
        # Pairs, because PyBullet's groups and masks change nothing between bodies that overlap already.
        for link in sorted(links):
            pybullet.setCollisionFilterPair(
                self._robot, body, link, ROOT_LINK, enableCollision=0, physicsClientId=self._client
            )

    def _look_around(self) -> None:
        """Have the solids in the physics that the robot can reach soon."""
        self._driven_m, self._ticks = 0.0, 0
        # A robot that brakes moves on, whatever its wheel commands are.
        linear_mps, _ = pybullet.getBaseVelocity(self._robot, physicsClientId=self._client)
        self._tick_m = max(math.hypot(*linear_mps) * TICK_S, self._commanded_tick_m())
        (x_m, y_m, _), _ = self.base_pose()
        self._near.look(x_m, y_m, self._reach_m + AHEAD_M)

    def _reach_of_robot_m(self) -> float:
        """Return how far from base_link the robot extends, by the boxes around its links."""
        (x_m, y_m, _), _ = self.base_pose()
        corners_m = [pybullet.getAABB(self._robot, link, physicsClientId=self._client) for link in self._links()]
        return max(
            math.hypot(x - x_m, y - y_m) for (low, high) in corners_m for x, y in product(*zip(low[:2], high[:2]))
        )

    def _settle(self, start_pose: Pose2D, floor_z_m: float) -> None:
        """Let the robot, the floor at a height in its own frame, settle onto its casters; then put it at the start."""
        self._resting_angles_rad = (0.0, 0.0)
        self._place_base((start_pose.x_m, start_pose.y_m, 0.0 - floor_z_m), quat_xyzw_from_yaw(start_pose.yaw_rad))
        self._reach_m = self._reach_of_robot_m()
        self._look_around()
        for _ in range(SETTLING_TICKS):
            self.tick(0.0, 0.0)
        self.place(start_pose)
        self._resting_angles_rad = self.wheels().angles_rad

    def _place_base(self, position_xyz_m: PositionXyz, quat_xyzw: QuatXyzw, velocity: PlanarVelocity = AT_REST) -> None:
        inertial = pybullet.multiplyTransforms(
            position_xyz_m, quat_xyzw, *pybullet.invertTransform(*self._base_in_inertial)
        )
        pybullet.resetBasePositionAndOrientation(self._robot, *inertial, physicsClientId=self._client)
        lever_m = np.subtract(inertial[0], position_xyz_m).tolist()
        x_mps, y_mps, yaw_radps = velocity
        pybullet.resetBaseVelocity(
            self._robot,
            (x_mps - yaw_radps * lever_m[1], y_mps + yaw_radps * lever_m[0], 0.0),
            (0.0, 0.0, yaw_radps),
            physicsClientId=self._client,
        )


def _turned_to_yaw(quat_xyzw: QuatXyzw, yaw_rad: float) -> QuatXyzw:
    """Return the same roll and pitch at another yaw."""
    roll_rad, pitch_rad, _ = pybullet.getEulerFromQuaternion(quat_xyzw)
    turned: QuatXyzw = pybullet.getQuaternionFromEuler((roll_rad, pitch_rad, yaw_rad))
    return turned
