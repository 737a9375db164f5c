"""Monte Carlo runs of the odometry of one drive over wheel phases, encoder errors, slip and geometry.

The true path is that of one drive of a robot without errors, as navigation or a driver keeps the robot on it; only the
final pose varies. The wheel angles follow from the path, the true geometry and slip; odometry follows from the angles,
the encoder and the geometry that odometry assumes.
"""

from __future__ import annotations

import copy
import math
from concurrent.futures import ThreadPoolExecutor
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice.answers import Travel
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.base.processes import usable_cores
from diff_encoder_sim.base.rounding import turns_text
from diff_encoder_sim.base.se2 import Pose2D, poses_of_wheels, wrap_angles
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.drives.test_definition import Segment, TestDefinition
from diff_encoder_sim.drives.trial_definition import Outcome, Trial, TrialPlan
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.calibration_file import CalibrationParams
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.simulated_robot import TrueWheels, load_simulated_robot
from diff_encoder_sim.robots.wheel_quality import EXACT, ROBOT_FILE, WheelQuality
from diff_encoder_sim.simulation.self_check import FlatFloor, RolledDrive
from diff_encoder_sim.simulation.slip import WheelErrorParams, WheelSlipParams, extra_travel
from diff_encoder_sim.simulation.state import TICK_S, JointStates
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams, spread_with
from diff_encoder_sim.trials.scripted_drive import SETTLING_S, ScriptedDrive
from diff_encoder_sim.wheels.chain import Chain, ChainRun
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import PROMPT
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# How a drive is known, in the words of the assumptions.
SIMULATED, RECORDED = " on the simulator's level floor, with its grip", ' as recorded, repeated'
IDEAL = f', from rest to rest on a level floor, with ends that vary by {X.tolerance:g} m and {YAW.tolerance:g} degrees'

FINEST = PerWheel(left=65536.0, right=65536.0)  # a navigated drive needs an encoder


class ErrorFreeDrive(NamedTuple):
    """Drive from a start to a goal."""

    requested: Trial
    rolled: RolledDrive
    origin: str = SIMULATED  # or RECORDED, IDEAL

    @property
    def test(self) -> str:
        """Return the name of the test."""
        return self.requested.test.name

    @property
    def goal_in_map(self) -> Pose2D:
        """Return the goal pose."""
        return self.requested.goal()

    @property
    def wheel_way_m(self) -> float:
        """Return the mean distance that the wheels roll."""
        return float(np.abs(np.diff(self.rolled.ways_m, axis=0)).sum(axis=0).mean())


def test_of(segment: Segment, like: TestDefinition) -> TestDefinition:
    """Return a test along a straight line or of turns in place, with the speeds of another test."""
    name = f'{turns_text(segment.turns)} in place' if segment.turns else f'{segment.straight:g} m straight'
    return like.model_copy(update={'name': name, 'drive': [segment], 'route': []})


def ideal(test: TestDefinition, robot: DrawnRobot) -> ErrorFreeDrive:
    """Follow a test's velocity profiles exactly, without a simulator."""
    script, separation_m = ScriptedDrive(test), float(robot.assumed[2])
    turns = sum(segment.turned for segment in test.drive)
    samples = min(MOST_IDEAL_SAMPLES, max(IDEAL_SAMPLES, math.ceil(SAMPLES_PER_TURN * turns)))
    times_s, period_s = np.linspace(0.0, script.duration_s, samples, retstep=True)
    linear_mps, angular_radps = np.array([script.command_at(each, period_s) for each in times_s[:-1].tolist()]).T
    steps_m = period_s * np.stack([linear_mps + sign * 0.5 * separation_m * angular_radps for sign in (-1, 1)], axis=-1)
    ways_m, end = np.cumsum(np.pad(steps_m, ((1, 0), (0, 0))), axis=0), test.drive_end()
    rolled = RolledDrive(times_s, ways_m, separation_m, end.relative_to(test.start.pose()))
    return ErrorFreeDrive(Trial(test=test, nav='scripted'), rolled, IDEAL)


def scripted(test: TestDefinition, robot: RobotSource, params: RobotParams) -> ErrorFreeDrive:
    """Drive a test's velocity profiles on a floor without walls; ConfigError if the robot description is invalid."""
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
    """Navigate a test's route with a fine encoder; ConfigError for an invalid file, or if the goal is not reached."""
    sound = params.simulator.model_copy(update={'wheel_errors': WheelErrorParams()})
    fine = {'encoder': IDEAL_ENCODER, 'ppr': FINEST}
    encoder, odometry = params.encoder.model_copy(update=fine), params.odometry.model_copy(update=fine)
    unrecorded = plan.model_copy(update={'trial': plan.trial.model_copy(update={'ppr': FINEST}), 'bag': ''})
    recorder = _Wheels()
    own = params._replace(simulator=sound, encoder=encoder, odometry=odometry)
    trial = LockstepTrial(unrecorded, source.file, own, recorder)
    for _ in trial.run():
        pass
    if trial.ending.outcome is not Outcome.SUCCEEDED:
        raise ConfigError(f'{plan.trial.test.name}: the robot does not come to its goal: {trial.ending.reason}')
    robot, start = load_simulated_robot(source, sound.choices()), plan.trial.test.start.pose()
    angles_rad = np.array(recorder.angles_rad) * robot.forward_signs
    ways_m = (angles_rad - angles_rad[0]) * robot.wheels[:2]
    axle = Pose2D(robot.description.axle_x_m, 0.0, 0.0)
    end = trial.true_pose_in_map.compose(axle).relative_to(start.compose(axle))
    times_s = TICK_S * np.arange(len(ways_m))
    return ErrorFreeDrive(plan.trial, RolledDrive(times_s, ways_m, robot.wheels.separation_m, end))


ENDS = 512  # final poses within the spread of the robot's stop
# Count reports per drive: more change the final error by a thousandth of its spread; of ideal drives, by a 400th.
MOST_SAMPLES, IDEAL_SAMPLES = 500, 200
# Fewer in a turn: roundings repeat in the same directions, and add up over many turns.
SAMPLES_PER_TURN, MOST_IDEAL_SAMPLES = 40, 2000
DRAWS_AT_A_TIME = 2**18 // MOST_SAMPLES  # larger arrays do not fit the processor's cache

# Causes of a difference between the wheels and their model in odometry.
RADIUS, SEPARATION, SLIP = 'wheel radius', 'wheel separation', 'wheel slip'
CONTACT = 'simulated contact'  # slip of error-free wheels on the simulated floor; not of a real robot
# What a calibration leaves open: a common factor of radii and separation, the ratio of the radii, and the mean radius
# over the separation.
CALIBRATED_GEOMETRY = ('calibration (scale)', 'calibration (ratio of radii)', 'calibration (radius / separation)')
# Columns: change of the logarithms of left radius, right radius and separation by each of CALIBRATED_GEOMETRY.
_LOGARITHMS = np.array([[1.0, -0.5, 0.0], [1.0, 0.5, 0.0], [1.0, 0.0, -1.0]])

Amounts = Mapping[str, float]  # of each cause from 0 (none, the default) to 1 (all)
ROBOTS_CAUSES: Amounts = dict.fromkeys((RADIUS, SEPARATION, SLIP, *CALIBRATED_GEOMETRY), 1.0)
ALL_CAUSES: Amounts = {**ROBOTS_CAUSES, CONTACT: 1.0}


class DrawnRobot(NamedTuple):
    """Robot from which samples with different wheels are drawn."""

    sound: Optional[TrueWheels]  # without errors; None: as odometry assumes
    errors: WheelErrorParams
    odometry: OdometryParams
    axle_x_m: float  # true position of the axle ahead of the base
    stop: StopSpread
    calibration: Optional[CalibrationParams] = None  # None: exact, except for `errors`
    quality: Optional[WheelQuality] = None  # of the wheels, which `errors` has; None: as the robot file states

    def with_quality(self, quality: WheelQuality) -> DrawnRobot:
        """Return the robot with the geometry errors of a quality; slip stays."""
        return self._replace(sound=None, errors=self.errors.model_copy(update=quality.errors), quality=quality)

    @property
    def own_quality(self) -> WheelQuality:
        """Return ROBOT_FILE if it has errors or a calibration, else EXACT."""
        return ROBOT_FILE if self.calibration or self.has(RADIUS) or self.has(SEPARATION) else EXACT

    @property
    def intervals(self) -> Optional[CalibrationParams]:
        """Return the calibration whose intervals the geometry has; None with a given quality."""
        return None if self.quality else self.calibration

    @property
    def means(self) -> np.ndarray:
        """Return the mean left and right radius and the mean separation [m] (3,)."""
        errors = self.errors
        relative = np.array([errors.left_radius_error, errors.right_radius_error, errors.wheel_separation_error])
        return np.asarray(np.array(self.assumed if self.sound is None else self.sound) * (1.0 + relative))

    @property
    def assumed(self) -> np.ndarray:
        """Return both radii and the separation that odometry assumes [m] (3,)."""
        return np.array([*self.odometry.wheel_diameter.radii_m, self.odometry.wheel_separation])

    @property
    def calibrated_covariance(self) -> np.ndarray:
        """Return the (3, 3) covariance of the relative errors CALIBRATED_GEOMETRY."""
        if self.intervals is None:
            return np.zeros((3, 3))
        to_causes = np.linalg.inv(_LOGARITHMS)
        return np.asarray(to_causes @ np.array(self.intervals.geometry_covariance) @ to_causes.T)

    @property
    def slip(self) -> Tuple[float, float, float, float]:
        """Return the constant slip of both wheels, 0 if the diameters contain it, and its variance per m and per rad.

        The variance contains that of bumps.
        """
        errors, calibration = self.errors, self.calibration
        if calibration is None:
            return errors.left_slip, errors.right_slip, errors.travel_variance, 0.0
        return 0.0, 0.0, calibration.slip_m2_per_m.value, calibration.slip_rad2_per_rad.value

    def wheels(self, amounts: Amounts, rng: np.random.Generator, draws: int) -> np.ndarray:
        """Sample left and right radius and separation [m] (3, draws, 1); without a cause those of odometry."""
        errors, normals = self.errors, rng.standard_normal((3, draws, 1))
        if self.intervals is not None:
            amount = np.array([amounts.get(cause, 0.0) for cause in CALIBRATED_GEOMETRY])
            relative = rng.multivariate_normal(np.zeros(3), self.calibrated_covariance, (1, draws), method='svd')
            return np.asarray(self.assumed * np.exp((amount * relative) @ _LOGARITHMS.T)).T
        spreads = np.array([errors.radius_spread, errors.radius_spread, errors.wheel_separation_spread])
        amount = np.array([amounts.get(cause, 0.0) for cause in (RADIUS, RADIUS, SEPARATION)])
        return np.asarray(self.assumed + amount * (self.means * (1.0 + spreads * normals.T) - self.assumed)).T

    def has(self, cause: str) -> bool:
        """Return whether the robot has this error."""
        errors, is_off = self.errors, ~np.isclose(self.means, self.assumed, rtol=1e-9, atol=0.0)
        if cause == SLIP:
            return any(self.slip) or self.errors.slip != WheelSlipParams()
        if cause in CALIBRATED_GEOMETRY:
            return bool(self.calibrated_covariance.diagonal()[CALIBRATED_GEOMETRY.index(cause)] > 0.0)
        if self.intervals is not None:
            return False
        if cause == SEPARATION:
            return bool(errors.wheel_separation_spread or is_off[2])
        return bool(errors.radius_spread or is_off[:2].any())


def drawn_robot(
    source: RobotSource, params: RobotParams, calibration: Optional[CalibrationParams] = None
) -> DrawnRobot:
    """Load a robot; ConfigError if the robot description is invalid."""
    robot = load_simulated_robot(source, params.simulator.choices())
    stop, axle_x_m = spread_with(params, params.encoder.counts_per_turn), robot.description.axle_x_m
    return DrawnRobot(robot.wheels, params.simulator.wheel_errors, params.odometry, axle_x_m, stop, calibration)


# Repetitions of a recorded drive end within the paper's tolerance of its end, so that no fraction of a count decides.
STOP_OF_RECORDED = StopSpread(X.tolerance, math.radians(YAW.tolerance))


def recorded(name: str, drive: Drive, robot: DrawnRobot) -> ErrorFreeDrive:
    """Return a recorded drive, whose true path is by the assumed geometry; ConfigError if the robot does not move."""
    angles_rad = drive.wheel_angles_rad - drive.wheel_angles_rad[0]
    ways_m, separation_m = angles_rad * robot.assumed[:2], float(robot.assumed[2])
    if not ways_m.any():
        raise ConfigError(f'--drive: {name}: the wheels do not turn')
    end, base_end = (Pose2D(*_ends(ways_m[np.newaxis], separation_m, x_m)[0].tolist()) for x_m in (0.0, robot.axle_x_m))
    goal = {'goal': dict(zip(('x', 'y', 'yaw'), base_end))}
    test = TestDefinition.from_mapping({'name': name, 'world': 'none', 'route': [goal]}, '--drive')
    times_s = 1e-9 * (drive.stamps_ns - drive.stamps_ns[0])
    return ErrorFreeDrive(Trial(test=test, nav='embedded'), RolledDrive(times_s, ways_m, separation_m, end), RECORDED)


class DriveDraws:
    """Monte Carlo runs of one drive; run i has the same phases, geometry and slip with every encoder."""

    def __init__(self, drive: ErrorFreeDrive, robot: DrawnRobot, seed: int) -> None:
        self.drive, self.robot, self.seed = drive, robot, seed
        self._exact: Optional[DriveDraws] = None  # the same runs on exact wheels, to which wheel errors are added
        self._known: Dict[object, Dict[Optional[EncoderParams], np.ndarray]] = {}  # errors, by draws and amounts
        rolled, ticks = drive.rolled, len(drive.rolled.times_s)
        samples = ticks if drive.origin == IDEAL else min(ticks, MOST_SAMPLES)
        rows = self._rows = np.unique(np.linspace(0, ticks - 1, samples).round().astype(np.int64))
        # Drives that end within the spread of the stop; the deviation grows in proportion to the distance.
        rng, way_m = self._generator('ends'), np.cumsum(np.abs(np.diff(rolled.ways_m, axis=0, prepend=0.0)).sum(axis=1))
        fractions = way_m[rows] / max(way_m[-1], 1e-9)
        ahead_m = rng.uniform(-1.0, 1.0, (ENDS, 1)) * robot.stop.position_m * fractions
        swing_m = rng.uniform(-1.0, 1.0, (ENDS, 1)) * 0.5 * rolled.separation_m * robot.stop.yaw_rad * fractions
        self._ways_m = rolled.ways_m[rows] + np.stack([ahead_m - swing_m, ahead_m + swing_m], axis=-1)
        self._ends = _ends(self._ways_m, rolled.separation_m, robot.axle_x_m)
        self._stamps_ns = np.rint(1e9 * rolled.times_s[rows]).astype(np.int64)
        self._commands = np.diff(rolled.ways_m[rows], axis=0, prepend=0.0)
        axle = Pose2D(robot.axle_x_m, 0.0, 0.0)
        true_end = axle.compose(rolled.end).compose(axle.inverse())
        self._contact_error = _ends(rolled.ways_m[np.newaxis], rolled.separation_m, axle.x_m)[0] - np.array(true_end)
        self._contact_error[2] = wrap_angles(self._contact_error[2])

    def of(self, robot: DrawnRobot, exact: Optional[DriveDraws] = None) -> DriveDraws:
        """Return the same runs of another robot, which share the errors of encoders with those on `exact` wheels.

        Errors of wheels and encoders add up: a wheel error of 1 % changes the error of an encoder by only 1 %.
        """
        other = copy.copy(self)
        other.robot, other._exact, other._known = robot, exact, {}
        return other

    @property
    def causes(self) -> List[str]:
        """Return the causes of errors, except the encoder's."""
        return [*filter(self.robot.has, ROBOTS_CAUSES), *([CONTACT] if self.drive.origin == SIMULATED else [])]

    def _generator(self, name: object) -> np.random.Generator:
        return generator(self.seed, f'{self.drive.test}_{name}')

    def errors(
        self, encoders: Sequence[Optional[EncoderParams]], draws: int, amounts: Amounts = ROBOTS_CAUSES
    ) -> List[np.ndarray]:
        """Return the (draws, 3) final errors of odometry with each encoder; None is one without quantisation.

        They are odometry minus true pose of the base, x [m], y [m] and yaw [rad] in the axes of the map.
        """
        known = self._known.setdefault((draws, *(amounts.get(cause, 0.0) for cause in self.causes)), {})
        new = [encoder for encoder in dict.fromkeys(encoders) if encoder not in known]
        if new and self._exact is None:
            known.update(zip(new, self._sampled(new, draws, amounts)))
        elif new and self._exact is not None:
            without, *errors = self._exact.errors([None, *new], draws, amounts)
            of_wheels = self._sampled([None], draws, amounts)[0] - without
            for encoder, error in zip(new, errors):
                known[encoder] = error + of_wheels
                known[encoder][:, 2] = wrap_angles(known[encoder][:, 2])
        return [known[encoder] for encoder in encoders]

    def _sampled(self, encoders: Sequence[Optional[EncoderParams]], draws: int, amounts: Amounts) -> List[np.ndarray]:
        with ThreadPoolExecutor(usable_cores()) as pool:
            portions = pool.map(
                lambda first: self._portion(encoders, first, min(DRAWS_AT_A_TIME, draws - first), amounts),
                range(0, draws, DRAWS_AT_A_TIME),
            )
            return list(map(np.concatenate, zip(*portions)))

    def errors_under_way(self, draws: int, amounts: Amounts = ROBOTS_CAUSES) -> np.ndarray:
        """Return the (draws, n, 3) errors along the drive without quantisation, as `errors`."""
        odometry, ways_m = self.robot.odometry, self._ways_m[np.arange(draws) % ENDS]
        geometry = *odometry.wheel_diameter.radii_m, odometry.wheel_separation, odometry.axle_x
        estimated = poses_of_wheels(self._turned(ways_m, 0, amounts), *geometry, False)
        true = poses_of_wheels(ways_m, 1.0, 1.0, self.drive.rolled.separation_m, self.robot.axle_x_m, False)
        return self._in_map(estimated - true)

    def travel(self, row: int) -> Travel:
        """Return the travel from the start to a row of `errors_under_way`."""
        left_m, right_m = self._commands.T
        turned_rad = np.abs(right_m - left_m) / self.drive.rolled.separation_m
        return Travel(float(np.cumsum(0.5 * np.abs(left_m + right_m))[row]), float(np.cumsum(turned_rad)[row]))

    def _portion(
        self, encoders: Sequence[Optional[EncoderParams]], first: int, draws: int, amounts: Amounts
    ) -> List[np.ndarray]:
        chosen = np.arange(first, first + draws) % ENDS
        turned_rad = self._turned(self._ways_m[chosen], first, amounts)
        reference = self._ends[chosen] - amounts.get(CONTACT, 0.0) * self._contact_error
        return [self._in_map(self._estimated(encoder, turned_rad, first, amounts) - reference) for encoder in encoders]

    def _estimated(
        self, encoder: Optional[EncoderParams], turned_rad: np.ndarray, first: int, amounts: Amounts
    ) -> np.ndarray:
        """Return the (draws, 3) final poses by odometry; the errors of wheels are in the angles `turned_rad`."""
        if encoder is None:
            odometry = self.robot.odometry
            return _ends(turned_rad, odometry.wheel_separation, odometry.axle_x, odometry.wheel_diameter.radii_m)
        return self._reports(encoder, turned_rad, first).final_poses

    def _reports(self, encoder: EncoderParams, turned_rad: np.ndarray, first: int) -> ChainRun:
        """Read the counters at all rows, without delays."""
        phases_rad = self._generator(f'phases_{first}').uniform(0.0, 2.0 * math.pi, (len(turned_rad), 2))
        seed = int(self._generator(f'encoders_{first}').integers(2**31))
        read = {'report': PROMPT, 'counter_modulus': 0, 'velocity_method': 'M', 'seed': seed}
        known = {'ppr': encoder.ppr, 'encoder': encoder.encoder, 'counter_modulus': 0}
        rows, odometry = np.arange(len(self._stamps_ns)), self.robot.odometry.model_copy(update=known)
        chain = Chain(encoder.model_copy(update=read), odometry, len(phases_rad))
        return chain.run(Drive(self._stamps_ns, turned_rad), phases_rad, self._commands, rows)

    def _in_map(self, errors: np.ndarray) -> np.ndarray:
        """Rotate (..., 3) errors from the axes of the start to those of the map, and wrap the heading."""
        x_m, y_m, error_rad = np.moveaxis(errors, -1, 0)
        start_rad = self.drive.requested.test.start.pose().yaw_rad
        cos, sin = math.cos(start_rad), math.sin(start_rad)
        return np.stack([cos * x_m - sin * y_m, sin * x_m + cos * y_m, wrap_angles(error_rad)], axis=-1)

    def _slip_by_motion(self) -> np.ndarray:
        """Return the (n, 2) travel of the wheels beyond rolling [m], by slip by motion; ends and geometry vary less."""
        by_motion, rolled = self.robot.errors.slip.by_motion, self.drive.rolled
        return extra_travel(by_motion, rolled.times_s, rolled.ways_m, rolled.separation_m)[self._rows]

    def _turned(self, ways_m: np.ndarray, first: int, amounts: Amounts) -> np.ndarray:
        """Return the (draws, n, 2) wheel angles since the start [rad]."""
        slipping, (*slips, noise_m, turn_noise_rad) = amounts.get(SLIP, 0.0), self.robot.slip
        *radii_m, separation_m = self.robot.wheels(amounts, self._generator(f'wheels_{first}'), len(ways_m))
        left_m, right_m = np.moveaxis(ways_m, 2, 0)
        half_m, mean_m = 0.5 * (right_m - left_m) * (separation_m / self.drive.rolled.separation_m), left_m + right_m
        rng, turned = self._generator(f'slip_{first}'), []
        for sign, radius_m, slip, extra_m in zip((-1.0, 1.0), radii_m, slips, self._slip_by_motion().T):
            way_m = 0.5 * mean_m + sign * half_m
            turned_rad = way_m / radius_m / (1.0 - slipping * slip) + slipping * extra_m / radius_m
            if slipping and noise_m:
                walk_m = _walks(slipping**2 * noise_m * np.abs(np.diff(way_m, axis=1)), rng)
                turned_rad[:, 1:] += walk_m / radius_m
            turned.append(turned_rad)
        if slipping and turn_noise_rad:
            turns_rad = np.abs(np.diff(2.0 * half_m / separation_m, axis=1))
            walk_m = 0.5 * separation_m * _walks(slipping**2 * turn_noise_rad * turns_rad, rng)
            for sign, radius_m, turned_rad in zip((-1.0, 1.0), radii_m, turned):
                turned_rad[:, 1:] += sign * walk_m / radius_m
        return np.stack(turned, axis=-1)


def _walks(variances: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Sample random walks with (draws, n) variances of their steps."""
    return np.asarray(np.cumsum(np.sqrt(variances) * rng.standard_normal(variances.shape), axis=1))


def _ends(
    turned: np.ndarray, wheel_separation_m: float, axle_x_m: float, per_turned_m: Tuple[float, float] = (1.0, 1.0)
) -> np.ndarray:
    """Return the (draws, 3) final pose of the base relative to its start, from exact wheel angles."""
    return poses_of_wheels(turned, *per_turned_m, wheel_separation_m, axle_x_m, True)[:, -1]
