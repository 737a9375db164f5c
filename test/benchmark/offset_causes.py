#!/usr/bin/env python3
"""What could turn and shift the paper's odometry in DLD: see docs/adr/0012-calibration.md.

Each possible cause is made as large as DLD's heading asks for, bias or spread, and acts to first order on the odometry
of our own drives. The paper does not print DLD's route: ours, ours ended elsewhere, and laps in one sense are tried."""

from __future__ import annotations

import argparse
import math
from typing import Any, Callable, Dict, List, NamedTuple, Sequence

import numpy as np
from checkout import ROOT, print_header
from counts import COUNT
from end_levers import EndLevers
from paper_offsets import ODOM, TESTS, TRUTH, Offset, PaperColumns, reach_of, standardised_ranges, table
from plans import paper_settings_with_ideal_wheels, plan_of

from diff_encoder_sim.analysis.paper.paper_cells import TRIALS
from diff_encoder_sim.analysis.quantities import YAW, X, Y
from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.base.yaml_files import yaml_value
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.robot_params import RobotParams, load_robot_config, override

CONFIG, ROBOT = ROOT / 'config', ROOT / 'urdf' / 'alto.urdf.xacro'
PPR = 4096
SEPARATION_M = 0.4
SLIP_NOISE = 2.7e-8  # of config/campaigns/paper.yaml [m^2/m]
DRIVING_STEP_M = 0.005  # in the 50 ms of a step; with less, the robot turns in place
ENDS_M = range(60, 95, 5)
LAP_RADIUS_M, LAPS_M = 3.0, 95.0
REPETITIONS = 20_000


class Drive(NamedTuple):
    """What our robot did in one trial with ideal wheels."""

    path: np.ndarray  # (n, 3) true poses on the way: x [m], y [m], yaw [rad]
    stop_deg: float  # true final heading minus the goal's
    turned_deg: float  # heading of the final odometry minus the true one
    shifted_m: float  # distance of the final odometry from the true position


class Cause(NamedTuple):
    """What turns the odometry on the way."""

    name: str  # with the unit of its size
    per_unit: Callable[[EndLevers], np.ndarray]  # (n,) turn of each step [rad]; of a noise, its variance [rad^2]


def while_driving(levers: EndLevers) -> np.ndarray:
    """Return the turns but those in place, (n,) in rad."""
    return np.where(np.abs(levers.lengths_m) > DRIVING_STEP_M, levers.turns_rad, 0.0)


def wheel_travel_m(levers: EndLevers) -> np.ndarray:
    """Return what both wheels together travel, (n,)."""
    of_turns_m = 0.5 * SEPARATION_M * levers.turns_rad
    return np.abs(levers.lengths_m - of_turns_m) + np.abs(levers.lengths_m + of_turns_m)


def at_the_start(levers: EndLevers) -> np.ndarray:
    """Return one radian in the first step."""
    return np.eye(1, len(levers.turns_rad))[0]


BIASES = (
    Cause('radius difference', lambda levers: -levers.lengths_m / SEPARATION_M),
    Cause('wheel separation', lambda levers: levers.turns_rad),
    Cause('slip in curves', while_driving),
    Cause('frame turned at the start [rad]', at_the_start),
)
NOISES = (
    Cause('slip noise [m^2/m]', lambda levers: wheel_travel_m(levers) / SEPARATION_M**2),
    Cause('slip noise of curves [rad]', lambda levers: np.abs(while_driving(levers))),
    Cause('frame turned at the start [rad^2]', at_the_start),
)


def drive(plan: TrialPlan, params: RobotParams) -> Drive:
    """Run one trial."""
    reports = list(LockstepTrial(plan, ROBOT, params).run())
    true = reports[-1].true_pose_in_map
    odometry = plan.trial.test.start.pose().compose(reports[-1].odometry.base_pose_in_odom)
    return Drive(
        np.array([report.true_pose_in_map for report in reports]),
        math.degrees(wrap_angle(true.yaw_rad - plan.trial.goal().yaw_rad)),
        math.degrees(wrap_angle(odometry.yaw_rad - true.yaw_rad)),
        math.hypot(odometry.x_m - true.x_m, odometry.y_m - true.y_m),
    )


def mirrored(plan: TrialPlan) -> TrialPlan:
    """Return the trial on the other side of the x axis, about which the ROS logo is symmetric."""

    def flipped(part: Any) -> Any:
        if isinstance(part, list):
            return [flipped(one) for one in part]
        if isinstance(part, dict):
            return {key: -one if key in ('y', 'yaw', 'turns') else flipped(one) for key, one in part.items()}
        return part

    test = TestDefinition.model_validate(flipped(plan.trial.test.model_dump(exclude_none=True)))
    return plan.model_copy(update={'trial': plan.trial.model_copy(update={'test': test})})


def one_sense_laps() -> np.ndarray:
    """Return the poses of counter-clockwise laps."""
    turned = np.linspace(0.0, LAPS_M / LAP_RADIUS_M, 2000)
    return np.column_stack((LAP_RADIUS_M * np.cos(turned), LAP_RADIUS_M * np.sin(turned), turned + 0.5 * math.pi))


def ended_elsewhere(path: np.ndarray) -> List[np.ndarray]:
    """Return the route cut off after each of ENDS_M."""
    way_m = np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))
    return [path[: np.searchsorted(way_m, end_m) + 1] for end_m in ENDS_M]


def bias(path: np.ndarray, cause: Cause) -> np.ndarray:
    """Return the change of the final odometry per unit of a cause: x [m], y [m], yaw [rad]."""
    levers = EndLevers(path)
    return cause.per_unit(levers) @ levers.by_heading


def spread(path: np.ndarray, cause: Cause) -> np.ndarray:
    """Return the standard deviations of the final odometry per root of a noise: x [m], y [m], yaw [rad]."""
    levers = EndLevers(path)
    return np.sqrt(cause.per_unit(levers) @ levers.by_heading**2)


def effect_table(
    paper_row: Sequence[str],
    causes: Sequence[Cause],
    effect: Callable[[np.ndarray, Cause], np.ndarray],
    dld_yaw_rad: float,
    paths: Dict[str, np.ndarray],
) -> str:
    """Tell what causes do to all tests when each is as large as the heading of DLD asks for."""
    rows: List[Sequence[str]] = [paper_row]
    for cause in causes:
        for name, route in (('ours', paths['DLD']), ('laps', one_sense_laps())):
            routes = [route, *(ended_elsewhere(route) if name == 'ours' else [])]
            sizes = [dld_yaw_rad / effect(one, cause)[2] for one in routes]
            shifts_m = [math.hypot(*(size * effect(one, cause)[:2])) for size, one in zip(sizes, routes)]
            straight, in_place = (sizes[0] * effect(paths[test], cause) for test in ('SL', 'SMT'))
            rows.append(
                [cause.name, name, f'{sizes[0]:.1e}', f'{straight[1]:+.3f}', f'{math.degrees(in_place[2]):+.2f}']
                + [f'{shifts_m[0]:.2f}', f'{min(shifts_m):.2f} to {max(shifts_m):.2f}' if shifts_m[1:] else '']
            )
    heads = ['', 'route', 'size', 'SL y [m]', 'SMT yaw [deg]', 'DLD position [m]', 'with other ends']
    return table(rows, heads)


def biases(paper: PaperColumns, paths: Dict[str, np.ndarray]) -> str:
    """Tell what causes of the offset would do."""
    x, y, yaw = (paper.pooled('DLD', quantity) for quantity in (X, Y, YAW))
    sideways, in_place = paper.pooled('SL', Y), paper.pooled('SMT', YAW)
    position = Offset(math.hypot(x.value, y.value), max(x.half, y.half))
    row = [f'paper: DLD yaw {yaw}', '', '', str(sideways), str(in_place), str(position), '']
    return effect_table(row, BIASES, bias, math.radians(yaw.value), paths)


def spreads(paper: PaperColumns, paths: Dict[str, np.ndarray]) -> str:
    """Tell what causes of the spread would do: standard deviations; a size is that of the root of the noise."""
    ppr = str(PPR)
    (x, *_), (y, *_), yaw = (paper.excess_spread('DLD', ppr, quantity) for quantity in (X, Y, YAW))
    sideways, in_place = paper.excess_spread('SL', ppr, Y), paper.excess_spread('SMT', ppr, YAW)
    row = ['paper: DLD yaw {:.2f} ({:.2f} to {:.2f})'.format(*yaw), '', '']
    row += [f'{sideways[0]:.3f}', f'{in_place[0]:.2f}', f'{math.hypot(x, y):.2f}', '']
    return effect_table(row, NOISES, spread, math.radians(yaw[0]), paths)


def slip_asked_for(paper: PaperColumns, paths: Dict[str, np.ndarray]) -> str:
    """Tell which slip noise each spread of odometry beyond truth asks for, all else being ideal."""
    rows = []
    # Not x of SL: to first order, turning does not shift it.
    for test, quantity in (('SL', Y), ('SL', YAW), ('SMT', YAW), ('DLD', X), ('DLD', Y), ('DLD', YAW)):
        printed = paper.excess_spread(test, str(PPR), quantity)
        routes = [paths[test], *(ended_elsewhere(paths[test]) if test == 'DLD' else [])]
        per_root = [quantity.scale * spread(path, NOISES[0])[quantity.component] for path in routes]
        asked = '{:.1e} ({:.1e} to {:.1e})'.format(*(printed / per_root[0]) ** 2)
        others = [(printed[0] / one) ** 2 for one in per_root[1:]]
        rows.append(
            [test, quantity.head, '{:.3f} ({:.3f} to {:.3f})'.format(*printed), asked]
            + [f'{min(others):.1e} to {max(others):.1e}' if others else '']
        )
    return table(rows, ['test', 'of', 'paper: odometry beyond truth', 'slip noise [m^2/m]', 'with other ends'])


def without_reset(paper: PaperColumns, path: np.ndarray) -> str:
    """Tell what 30 trials look like when odometry is never reset: the errors of x, y and yaw each add up."""
    rng = np.random.default_rng(0)
    deviations = math.sqrt(SLIP_NOISE) * spread(path, NOISES[0])
    yaw, ppr = paper.pooled('DLD', YAW), str(PPR)
    rows = [['paper', str(yaw), f'{paper.excess_spread("DLD", ppr, YAW)[0]:.2f}', *_reaches(paper)]]
    drift_deg = yaw.value / np.arange(1, TRIALS + 1).mean()
    for name, each_lap_deg in (('slip noise alone', 0.0), (f'and {drift_deg:+.2f} deg a lap', drift_deg)):
        laps = deviations * rng.standard_normal((REPETITIONS, TRIALS, 3))
        laps[..., 2] += math.radians(each_lap_deg)
        ends = np.cumsum(laps, axis=1)
        means_deg = np.degrees(ends[..., 2]).mean(axis=1)
        chances = [
            np.mean(standardised_ranges(ends[..., one.component]) >= reach_of(paper.statistics(ODOM, 'DLD', ppr, one)))
            for one in (X, Y)
        ]
        mean = Offset(float(means_deg.mean()), 1.96 * float(means_deg.std()))
        spread_deg = np.median(np.degrees(ends[..., 2]).std(axis=1))
        rows.append([name, str(mean), f'{spread_deg:.2f}', *(f'{chance:.5f}' for chance in chances)])
    return table(rows, ['', 'mean of yaw [deg]', 'std dev', 'x: range / std dev, or its chance', 'y'])


def _reaches(paper: PaperColumns) -> List[str]:
    return [f'{reach_of(paper.statistics(ODOM, "DLD", str(PPR), one)):.2f}' for one in (X, Y)]


def stops(paper: PaperColumns, drives: Dict[str, List[Drive]]) -> str:
    """Tell on which side of the goal's heading robots stop, and what the simulator's own contacts do."""
    rows = []
    for name, of_test in drives.items():
        columns = np.array([[one.stop_deg, one.turned_deg, one.shifted_m] for one in of_test]).T
        ours = [f'{values.mean():+.2f} ({values.min():+.2f} to {values.max():+.2f})' for values in columns]
        rows.append([name, str(paper.mean(TRUTH, name, str(PPR), YAW)) if name in TESTS else '', *ours])
    heads = ['yaw [deg]', 'paper: truth minus goal', 'ours', 'ours: odometry minus truth', 'its position [m]']
    return table(rows, heads)


def main() -> None:
    """Drive, and print what each cause does."""
    arguments = _arguments()
    print_header(f"Causes of the offset of DLD's odometry, {arguments.trials} trials a test with ideal wheels")
    paper = PaperColumns()
    plans = {test: [plan_of(test, PPR, seed + 1) for seed in range(arguments.trials)] for test in TESTS}
    plans['DLD, mirrored'] = [mirrored(plan) for plan in plans['DLD']]
    given = {key: yaml_value(text, key) for key, _, text in (one.partition('=') for one in arguments.set)}
    params = override(load_robot_config(CONFIG), {**paper_settings_with_ideal_wheels(), **given})
    drives = {name: [drive(plan, params) for plan in of_test] for name, of_test in plans.items()}
    paths = {test: of_test[0].path for test, of_test in drives.items()}
    for title, text in (
        ('Truth: the side on which the robot stops', stops(paper, drives)),
        ('Offset', biases(paper, paths)),
        ('Spread', spreads(paper, paths)),
        ('Spread, each by itself', slip_asked_for(paper, paths)),
        ('Odometry that is not reset between trials', without_reset(paper, paths['DLD'])),
    ):
        print(title, text, '', sep='\n')


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--trials', type=COUNT, default=10)
    parser.add_argument(
        '--set', nargs='*', default=[], metavar='KEY=VALUE', help='simulator.physics.solver_iterations=100'
    )
    return parser.parse_args()


if __name__ == '__main__':
    main()
