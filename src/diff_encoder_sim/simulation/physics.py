"""PyBullet behind a narrow interface: one robot on static solids, stepped at a fixed rate.

Step and solver iterations are the outcome of a convergence study: docs/adr/0001-contact-and-step.md,
test/benchmark/physics_convergence.py. Contact shapes are those of robots/simulated_robot.py.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import importlib
import math
import os
import sys
import tempfile
from itertools import product
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Iterator, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError, MissingLibrary
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw, yaw_from_quat_xyzw
from diff_encoder_sim.base.xml_values import rpy_from_rotation
from diff_encoder_sim.robots.simulated_robot import SimulatedRobot
from diff_encoder_sim.robots.solids import Box, Cylinder, Shape, Sphere, reach_m
from diff_encoder_sim.simulation.state import AT_REST, TICK_S, BodyState, PlanarVelocity
from diff_encoder_sim.simulation.world import Plane, Solid, World

GRAVITY_MPS2 = 9.81
SETTLING_TICKS = 50
ROOT_LINK = -1
# A wheel that rolls on in one step by less than this part of its radius keeps one contact point; of a faster one, up to
# four are kept, which takes twice the time. Each of several parts of the robot near the floor would be as costly, and
# near a wall the robot would seem to touch it: points farther apart than the other number are left out.
CONTACT_BREAKING, TOUCHING_M = 0.2, 1e-3
# How far beyond the robot's reach solids are in the physics, and how far it may drive until they are looked at again:
# what is left over is for a robot that still moves while its wheels are commanded to stop.
AHEAD_M, LOOK_AGAIN_M = 1.0, 0.5
LOOK_AGAIN_TICKS = 100  # also where the wheels stand, and the robot slides
SOLVER_RESIDUAL_THRESHOLD = 1e-9  # PyBullet's 1e-7 stops early where there are more iterations

PositionXyz = Tuple[float, float, float]
QuatXyzw = Tuple[float, float, float, float]
PoseXyzQuat = Tuple[PositionXyz, QuatXyzw]


@contextlib.contextmanager
def silence() -> Iterator[None]:
    """Silence standard output and error, as PyBullet prints by C's printf, past sys.stdout."""
    flush_c, descriptors = ctypes.CDLL(None).fflush, (1, 2)
    sys.stdout.flush()
    sys.stderr.flush()
    flush_c(None)
    kept, nowhere = [os.dup(descriptor) for descriptor in descriptors], os.open(os.devnull, os.O_WRONLY)
    try:
        for descriptor in descriptors:
            os.dup2(nowhere, descriptor)
        yield
    finally:
        flush_c(None)
        for descriptor, copy in zip(descriptors, kept):
            os.dup2(copy, descriptor)
            os.close(copy)
        os.close(nowhere)


def _import_quietly(name: str) -> Any:
    try:
        with silence():
            return importlib.import_module(name)
    except ModuleNotFoundError:
        raise MissingLibrary(
            'PyBullet, which simulates the robot, is not installed; allowed: commands without simulation (advise with '
            '--wheel-diameter or --drive, calibrate, reencode, analyze, map_bag, rasterise_world); or pip install '
            'pybullet, as the extra [sim] does (Python 3.8 to 3.11 have wheels; newer ones compile it, in ten minutes)'
        ) from None


pybullet = deferred('pybullet', _import_quietly)


class _BulletWorld:
    """PyBullet's functions, for one of its worlds."""

    def __init__(self) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)

    def __getattr__(self, name: str) -> Any:
        function = functools.partial(getattr(pybullet, name), physicsClientId=self._client)
        setattr(self, name, function)  # found without this method from now on
        return function


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
        self._bullet: Any = _BulletWorld()
        bullet = self._bullet
        try:
            bullet.setGravity(0, 0, -GRAVITY_MPS2)
            bullet.setPhysicsEngineParameter(
                fixedTimeStep=TICK_S,
                numSubSteps=params.steps_per_tick,
                numSolverIterations=params.solver_iterations,
                solverResidualThreshold=SOLVER_RESIDUAL_THRESHOLD,
                deterministicOverlappingPairs=1,
                contactBreakingThreshold=CONTACT_BREAKING,
            )
            floors = [solid for solid in world.solids if isinstance(solid.shape, Plane)]
            obstacles = [solid for solid in world.solids if not isinstance(solid.shape, Plane)]
            self._floors = [_add_body(bullet, _add_shape(bullet, floor), floor) for floor in floors]
            self._robot = self._load(robot)
            infos = [bullet.getJointInfo(self._robot, link) for link in range(bullet.getNumJoints(self._robot))]
            self._links = range(ROOT_LINK, len(infos))  # PyBullet's numbers
            for link in self._links:
                bullet.changeDynamics(self._robot, link, contactProcessingThreshold=TOUCHING_M)
            self._joint_names = {info[0]: info[1].decode() for info in infos}  # by the link below the joint
            by_joint = {name: link for link, name in self._joint_names.items()}
            self._wheel_joints = tuple(by_joint[name] for name in robot.joints)
            # Links that touch only floors, which the others then do not touch; without any, all touches all.
            by_name = {info[12].decode(): info[0] for info in infos}
            self._floor_only = tuple(by_name[name] for name in robot.floor_only_links)
            for floor in self._floors if self._floor_only else ():
                self._filter(floor, {*self._links} - {*self._floor_only})
            self._near = _NearSolids(bullet, obstacles, lambda solid: self._filter(solid, self._floor_only))
            self._wheel_radius_m = max(robot.wheels[:2])
            self._driven_m, self._ticks = 0.0, 0  # since the near solids were looked at
            self._tick_m = 0.0  # that the robot may move in a tick: the most of it since then
            self._set_motors(0.0, 0.0)
            dynamics = bullet.getDynamicsInfo(self._robot, ROOT_LINK)
            # base_link's pose in the frame of the root's centre of mass.
            self.base_in_inertial: PoseXyzQuat = pybullet.invertTransform(dynamics[3], dynamics[4])
            self._settle(start_pose, robot.description.floor_z_m)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Free PyBullet's world; the object cannot be used afterwards."""
        if self._bullet is not None:
            self._bullet.disconnect()
            self._bullet = None

    def tick(self, left_radps: float, right_radps: float) -> None:
        """Drive the wheels at these speeds, as far as torque allows, for 10 ms."""
        if (left_radps, right_radps) != self._motor_speeds_radps:
            self._set_motors(left_radps, right_radps)
        self._bullet.stepSimulation()
        self._driven_m += self._tick_m
        self._ticks += 1
        if self._driven_m > LOOK_AGAIN_M or self._ticks >= LOOK_AGAIN_TICKS:
            self._look_around()

    def _set_motors(self, left_radps: float, right_radps: float) -> None:
        """Have the motors keep to speeds, until they are set to others."""
        self._bullet.setJointMotorControlArray(
            self._robot,
            self._wheel_joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=(left_radps, right_radps),
            forces=(self._wheel_torque_nm, self._wheel_torque_nm),
        )
        self._motor_speeds_radps = left_radps, right_radps
        self._tick_m = max(self._tick_m, self._commanded_tick_m())

    def _commanded_tick_m(self) -> float:
        return max(map(abs, self._motor_speeds_radps)) * self._wheel_radius_m * TICK_S

    def wheels(self) -> WheelState:
        """Return the rotation of the wheels against the body since the start."""
        left, right = self._bullet.getJointStates(self._robot, self._wheel_joints)
        return WheelState(
            (left[0] - self._resting_angles_rad[0], right[0] - self._resting_angles_rad[1]), (left[1], right[1])
        )

    def base(self) -> BodyState:
        """Return the true state of base_link in the world."""
        mass_m, mass_quat = self._bullet.getBasePositionAndOrientation(self._robot)  # of the root's centre of mass
        base_m, base_quat = pybullet.multiplyTransforms(mass_m, mass_quat, *self.base_in_inertial)
        linear, angular = self._bullet.getBaseVelocity(self._robot)
        # The velocity of another point of a rigid body: v + w x r.
        x_m, y_m, z_m = (base - mass for base, mass in zip(base_m, mass_m))
        roll_radps, pitch_radps, yaw_radps = angular
        velocity_mps = (
            linear[0] + (pitch_radps * z_m - yaw_radps * y_m),
            linear[1] + (yaw_radps * x_m - roll_radps * z_m),
            linear[2] + (roll_radps * y_m - pitch_radps * x_m),
        )
        return BodyState(base_m, base_quat, velocity_mps, angular)

    def inertial_motion(self) -> Tuple[float, ...]:
        """Return the true motion of the root's centre of mass, in whose frame base_link is `base_in_inertial`.

        It is the orientation x, y, z, w, velocity [m/s] and angular velocity [rad/s] in the world frame.
        """
        _, quat = self._bullet.getBasePositionAndOrientation(self._robot)
        linear, angular = self._bullet.getBaseVelocity(self._robot)
        return (*quat, *linear, *angular)

    def base_pose(self) -> PoseXyzQuat:
        """Return the true position [m] and orientation of base_link in the world."""
        inertial = self._bullet.getBasePositionAndOrientation(self._robot)
        pose: PoseXyzQuat = pybullet.multiplyTransforms(*inertial, *self.base_in_inertial)
        return pose

    def base_pose_in_plane(self) -> Pose2D:
        """Return the true pose of base_link in the plane of the world frame."""
        (x_m, y_m, _), quat_xyzw = self.base_pose()
        return Pose2D(x_m, y_m, yaw_from_quat_xyzw(*quat_xyzw))

    def place(self, pose: Pose2D, velocity: PlanarVelocity = AT_REST) -> None:
        """Lift the robot to a pose on the floor, moving at a velocity, wheel angles, roll and pitch as they are."""
        position, quat = self.base_pose()
        roll_rad, pitch_rad, _ = pybullet.getEulerFromQuaternion(quat)
        turned = pybullet.getQuaternionFromEuler((roll_rad, pitch_rad, pose.yaw_rad))
        self._place_base((pose.x_m, pose.y_m, position[2]), turned, velocity)
        self._look_around()

    def obstacle_hit(self) -> Optional[str]:
        """Return the name of a solid, other than the floor, that the robot touches, if any."""
        names = self._near.names
        if not names:
            return None
        contacts = self._bullet.getContactPoints(bodyA=self._robot)
        touched = (contact[2] for contact in contacts if contact[2] in names and contact[8] < TOUCHING_M)
        return next(map(names.__getitem__, touched), None)

    def floor_loads(self) -> Dict[str, float]:
        """Return the fraction of the weight on each link, by the joint that it hangs on, that stands on the floor."""
        loads_n: Dict[str, float] = {}
        for contact in self._bullet.getContactPoints(bodyA=self._robot):
            if contact[2] in self._floors and contact[9] > 0.0:
                name = self._joint_names.get(contact[3], '')
                loads_n[name] = loads_n.get(name, 0.0) + contact[9]
        # Fractions: PyBullet gives the force of a sub-step over the whole step.
        return {name: load_n / sum(loads_n.values()) for name, load_n in loads_n.items()}

    def is_seen(self, from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
        """Return for (n, 3) points in the world whether a ray from each to another (n, 3) point hits the robot."""
        rays = self._bullet.rayTestBatch(from_m.tolist(), to_m.tolist())
        return np.array([ray[0] == self._robot and ray[1] not in self._floor_only for ray in rays])

    def _load(self, robot: SimulatedRobot) -> int:
        # Not URDF_MERGE_FIXED_LINKS: it misplaces the centre of mass, and the casters get friction.
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, 'robot.urdf')
            # A line for each tag: PyBullet cuts lines after 8191 characters, in the middle of a number, too.
            file.write_text(robot.urdf.replace('><', '>\n<'), encoding='utf-8')
            try:
                with silence():
                    return int(self._bullet.loadURDF(str(file), flags=flags))
            except pybullet.error:
                raise ConfigError(f'{robot.description.tree.where}: PyBullet cannot load its URDF') from None

    def _filter(self, body: int, links: Iterable[int]) -> None:
        """Keep links off a body."""
        # Pairs, because PyBullet's groups and masks change nothing between bodies that overlap already.
        for link in sorted(links):
            self._bullet.setCollisionFilterPair(self._robot, body, link, ROOT_LINK, enableCollision=0)

    def _look_around(self) -> None:
        """Have the solids in the physics that the robot can reach soon."""
        self._driven_m, self._ticks = 0.0, 0
        # A robot that brakes moves on, whatever its wheel commands are.
        linear_mps, _ = self._bullet.getBaseVelocity(self._robot)
        self._tick_m = max(math.hypot(*linear_mps) * TICK_S, self._commanded_tick_m())
        (x_m, y_m, _), _ = self.base_pose()
        self._near.look(x_m, y_m, self._reach_m + AHEAD_M)

    def _settle(self, start_pose: Pose2D, floor_z_m: float) -> None:
        """Let the robot, the floor at a height in its own frame, settle onto its casters; then put it at the start."""
        self._resting_angles_rad = (0.0, 0.0)
        self._place_base((start_pose.x_m, start_pose.y_m, 0.0 - floor_z_m), quat_xyzw_from_yaw(start_pose.yaw_rad))
        # How far from base_link the robot extends, by the boxes around its links.
        (x_m, y_m, _), _ = self.base_pose()
        boxes_m = [self._bullet.getAABB(self._robot, link) for link in self._links]
        self._reach_m = max(
            math.hypot(x - x_m, y - y_m) for low, high in boxes_m for x, y in product(*zip(low[:2], high[:2]))
        )
        self._look_around()
        for _ in range(SETTLING_TICKS):
            self.tick(0.0, 0.0)
        self.place(start_pose)
        self._resting_angles_rad = self.wheels().angles_rad

    def _place_base(self, position_xyz_m: PositionXyz, quat_xyzw: QuatXyzw, velocity: PlanarVelocity = AT_REST) -> None:
        inertial = pybullet.multiplyTransforms(
            position_xyz_m, quat_xyzw, *pybullet.invertTransform(*self.base_in_inertial)
        )
        self._bullet.resetBasePositionAndOrientation(self._robot, *inertial)
        lever_x_m, lever_y_m, _ = np.subtract(inertial[0], position_xyz_m).tolist()
        x_mps, y_mps, yaw_radps = velocity
        linear_mps = x_mps - yaw_radps * lever_y_m, y_mps + yaw_radps * lever_x_m, 0.0
        self._bullet.resetBaseVelocity(self._robot, linear_mps, (0.0, 0.0, yaw_radps))


def _add_shape(bullet: Any, solid: Solid) -> int:
    """Make a solid's collision shape in one of PyBullet's worlds, and return its number."""
    shape, arguments = solid.shape, {'shapeType': pybullet.GEOM_PLANE}
    if isinstance(shape, Box):
        arguments = {'shapeType': pybullet.GEOM_BOX, 'halfExtents': [0.5 * length_m for length_m in shape.size_xyz_m]}
    elif isinstance(shape, Cylinder):
        arguments = {'shapeType': pybullet.GEOM_CYLINDER, 'radius': shape.radius_m, 'height': shape.length_m}
    elif isinstance(shape, Sphere):
        arguments = {'shapeType': pybullet.GEOM_SPHERE, 'radius': shape.radius_m}
    return int(bullet.createCollisionShape(**arguments))


def _add_body(bullet: Any, shape: int, solid: Solid) -> int:
    """Put a solid of a shape into one of PyBullet's worlds, and return its number there."""
    # A plain rigid body: one of PyBullet's multibodies is moved on in each step even where it
    # stands still, which in a world of 49 solids takes a third of the time.
    return int(
        bullet.createMultiBody(
            baseMass=0,
            baseCollisionShapeIndex=shape,
            basePosition=solid.pose_in_world[:3, 3].tolist(),
            baseOrientation=pybullet.getQuaternionFromEuler(rpy_from_rotation(solid.pose_in_world[:3, :3])),
            useMaximalCoordinates=1,
        )
    )


class _NearSolids:
    """Keeps the bodies of the near solids in one of PyBullet's worlds; `on_added` gets the number of each new one."""

    def __init__(self, bullet: Any, solids: Sequence[Solid], on_added: Callable[[int], None]) -> None:
        self._bullet, self._solids, self._on_added = bullet, solids, on_added
        self._shapes = [_add_shape(bullet, solid) for solid in solids]
        shapes = [Shape(each.shape, each.pose_in_world) for each in solids if not isinstance(each.shape, Plane)]
        axes = np.eye(3)[:2]
        self._low_m = np.array([[-reach_m([shape], -axis) for axis in axes] for shape in shapes]).reshape(-1, 2)
        self._high_m = np.array([[reach_m([shape], axis) for axis in axes] for shape in shapes]).reshape(-1, 2)
        self._bodies: Dict[int, int] = {}  # by index of the solid
        self.names: Dict[int, str] = {}  # of the solids in the physics, by body

    def look(self, x_m: float, y_m: float, reach_m: float) -> None:
        """Keep the solids within a distance of a place [m] in the physics, and no others."""
        place_m = np.array([x_m, y_m])
        away_m = np.maximum(np.maximum(self._low_m - place_m, place_m - self._high_m), 0.0)
        near = set(np.flatnonzero(np.hypot(*away_m.T) <= reach_m).tolist())
        for index in sorted(self._bodies.keys() - near):
            body = self._bodies.pop(index)
            del self.names[body]
            self._bullet.removeBody(body)
        for index in sorted(near - self._bodies.keys()):
            body = self._bodies[index] = _add_body(self._bullet, self._shapes[index], self._solids[index])
            self.names[body] = self._solids[index].name
            self._on_added(body)
