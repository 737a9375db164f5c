"""One drive per test of a robot without errors: distances of the wheels and true final pose."""

from __future__ import annotations

from typing import List, NamedTuple, Sequence

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import Segment, TestDefinition
from diff_encoder_sim.drives.trial_definition import Outcome, Trial, TrialPlan
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.simulated_robot import load_simulated_robot
from diff_encoder_sim.simulation.self_check import FlatFloor, RolledDrive
from diff_encoder_sim.simulation.simulator import WheelErrorParams
from diff_encoder_sim.simulation.state import TICK_S, JointStates
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.scripted_drive import SETTLING_S, ScriptedDrive
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, PerWheel

# A navigated drive needs an encoder.
FINEST = PerWheel(left=65536.0, right=65536.0)


class ErrorFreeDrive(NamedTuple):
    """Drive from a start to a goal."""

    requested: Trial
    rolled: RolledDrive

    @property
    def test(self) -> str:
        """Return the name of the test."""
        return self.requested.test.name

    @property
    def start_in_map(self) -> Pose2D:
        """Return the start pose."""
        return self.requested.test.start.pose()

    @property
    def goal_in_map(self) -> Pose2D:
        """Return the goal pose."""
        return self.requested.goal()

    @property
    def wheel_way_m(self) -> float:
        """Return the mean distance that the wheels roll."""
        return float(np.abs(np.diff(self.rolled.ways_m, axis=0)).sum(axis=0).mean())


def straight_test(distance_m: float, like: TestDefinition) -> TestDefinition:
    """Return a test along a straight line with the speeds of another test."""
    straight = {'name': f'{distance_m:g} m straight', 'drive': [Segment(straight=distance_m)], 'route': []}
    return like.model_copy(update=straight)


def scripted(test: TestDefinition, robot: RobotSource, params: RobotParams) -> ErrorFreeDrive:
    """Drive a test's velocity profiles on a floor without walls.

    Raises:
        ConfigError: the robot description is invalid.
    """
    script, simulator = ScriptedDrive(test), params.simulator
    floor = FlatFloor(load_simulated_robot(robot, simulator.choices()), simulator.drive, simulator.physics)
    try:
        rolled = floor.follow(script.command_at, script.duration_s + SETTLING_S)
    finally:
        floor.close()
    return ErrorFreeDrive(Trial(test=test, nav='scripted'), rolled)


class _Wheels(Publications):
    """Records the joint angles."""

    def __init__(self) -> None:
        self.angles_rad: List[Sequence[float]] = []

    def joint_states(self, joints: JointStates) -> None:
        self.angles_rad.append(joints.angles_rad)


def navigated(plan: TrialPlan, source: RobotSource, params: RobotParams) -> ErrorFreeDrive:
    """Navigate a test's route with a fine encoder.

    Raises:
        ConfigError: a file is invalid, or the robot did not reach its goal.
    """
    sound = params.simulator.model_copy(update={'wheel_errors': WheelErrorParams()})
    fine = {'encoder': IDEAL_ENCODER, 'ppr': FINEST}
    encoder, odometry = params.encoder.model_copy(update=fine), params.odometry.model_copy(update=fine)
    recorder = _Wheels()
    unrecorded = plan.model_copy(update={'trial': plan.trial.model_copy(update={'ppr': FINEST}), 'bag': ''})
    without_errors = params._replace(simulator=sound, encoder=encoder, odometry=odometry)
    trial = LockstepTrial(unrecorded, source.file, without_errors, recorder)
    for _ in trial.run():
        pass
    if trial.ending.outcome is not Outcome.SUCCEEDED:
        raise ConfigError(f'{plan.trial.test.name}: the robot does not come to its goal: {trial.ending.reason}')
    robot, start = load_simulated_robot(source, sound.choices()), plan.trial.test.start.pose()
    angles_rad = np.array(recorder.angles_rad) * robot.forward_signs
    ways_m = (angles_rad - angles_rad[0]) * robot.wheels[:2]
    axle = Pose2D(robot.description.axle_x_m, 0.0, 0.0)
    end = trial.true_pose_in_map.compose(axle).relative_to(start.compose(axle))
    return ErrorFreeDrive(
        plan.trial, RolledDrive(TICK_S * np.arange(len(ways_m)), ways_m, robot.wheels.separation_m, end)
    )
