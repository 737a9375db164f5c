#!/usr/bin/env python3
"""Time one AMCL update: by particles and beams, by its parts, by laser model, by map size, and as KLD-sampling
adapts it on the shipped worlds; compile time apart. Then its error there, and whether its covariance matches.
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Callable, List, NamedTuple, Tuple

import numpy as np
from checkout import ROOT, first_call_s, print_header
from counts import COUNT
from tabulate import tabulate

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.histogram import kld_limits, particle_statistics, resample
from diff_encoder_sim.localization.laser_models import laser_model
from diff_encoder_sim.localization.occupancy_grid import FreeCells, OccupancyGrid
from diff_encoder_sim.localization.particles import move_particles
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world

RESOLUTION_M, SCAN_HEIGHT_M = 0.05, 0.3
# Table 2 of the paper.
PAPER = dict(
    max_particles=3000,
    laser_max_range=3.5,
    laser_max_beams=180,
    laser_z_hit=0.9,
    laser_z_short=0.05,
    laser_z_rand=0.5,
    laser_sigma_hit=0.2,
    kld_err=0.02,
)
PARTICLES, BEAMS = (100, 300, 1000, 3000, 10000), (30, 60, 180, 360)
UPSTREAM_MS = 'upstream in C++ on a similar host: 14.9 ms at 3000 x 180, 0.85 ms as KLD adapts it'


class Place(NamedTuple):
    """A world, and how the robot moves in it from one update to the next."""

    world: str
    start: Pose2D
    forward_m: float
    turn_rad: float
    updates: int


SL = Place('hallway', Pose2D(-10.0, 0.0, 0.0), 0.21, 0.0, 94)
SMT = Place('ros_logo', Pose2D(-3.4, -0.85, 0.0), 0.0, 0.55, 57)


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    print_header('Cost of an AMCL update, one thread')
    _print_compile_time()
    for title, headers, rows in (
        (
            'ms per update, hallway, likelihood field, no KLD limit, resampled each time',
            ['particles'] + [f'{beams} beams' for beams in BEAMS],
            _by_size(arguments.calls),
        ),
        ('ms for each part, 3000 particles x 180 beams', ['part', 'ms'], _by_part(arguments.calls)),
        (
            'ms to weigh 3000 particles x 180 beams, by laser model',
            ['model', 'ms'],
            _by_model(max(arguments.calls // 10, 3)),
        ),
        (
            'by map size, 3000 particles all over it x 180 beams',
            ['map [m]', 'cell [m]', 'cells', 'new map\n[ms]', 'weigh\n[ms]'],
            _by_map(arguments.calls),
        ),
        (
            "as KLD-sampling adapts it, the paper's table 2",
            ['test', 'updates', 'particles\nmedian', 'most', 'update\nmedian [ms]', '95 % [ms]', 'worst [ms]'],
            [_as_adapted('SL', SL), _as_adapted('SMT', SMT)],
        ),
        (
            f'at the end of {arguments.trials} trials of those, with exact odometry',
            [
                'test',
                'error x\n[mm]',
                'error y\n[mm]',
                'error yaw\n[deg]',
                'std. dev.\nx [mm]',
                'y [mm]',
                'yaw [deg]',
                'NEES',
            ],
            [_accuracy(name, place, arguments.trials) for name, place in (('SL', SL), ('SMT', SMT))],
        ),
    ):
        print(f'\n{title}\n')
        print(tabulate(rows, headers, disable_numparse=True, stralign='right'))
    print(f'\nWall time, median of {arguments.calls} calls; {UPSTREAM_MS}.')
    print(
        'Errors are root mean squares over trials, standard deviations those of the published '
        'covariance.\nNEES: mean squared error by that covariance; 3 is consistent, less is '
        'cautious.'
    )


def _by_size(calls: int) -> List[List[str]]:
    lidar, grid = _scanner_and_map(SL, 360)
    rows = []
    for particles in PARTICLES:
        row = [f'{particles}']
        for beams in BEAMS:
            amcl = _amcl(
                grid, SL, laser_max_beams=beams, min_particles=particles, max_particles=particles, resample_interval=1
            )
            scan = _thinned(lidar.scan(0, SL.start), beams)
            row.append(f'{_median_ms(lambda: _forced(amcl, scan), calls):.2f}')
        rows.append(row)
    return rows


def _by_part(calls: int) -> List[List[str]]:
    lidar, grid = _scanner_and_map(SL, 180)
    params, rng = _params(SL), np.random.default_rng(0)
    amcl = Amcl(params, grid, rng)
    particles, weights = amcl.particles, amcl.weights
    limits, model = kld_limits(params), laser_model(params, grid)
    scan, free_cells = _thinned(lidar.scan(0, SL.start), 180), FreeCells(grid)
    beams = model.beams(scan, IDENTITY)
    parts: List[Tuple[str, Callable[[], object]]] = [
        ('move the particles', lambda: move_particles(particles, IDENTITY, Pose2D(0.2, 0.0, 0.1), params, rng)),
        ('prepare the scan', lambda: model.beams(scan, IDENTITY)),
        ('weigh the particles', lambda: model.likelihoods(particles, beams, False)),
        ('resample', lambda: resample(particles, weights, limits, 0.0, free_cells, rng)),
        ('cluster', lambda: particle_statistics(particles, weights)),
    ]
    return [[name, f'{_median_ms(part, calls):.3f}'] for name, part in parts]


def _by_model(calls: int) -> List[List[str]]:
    lidar, grid = _scanner_and_map(SL, 180)
    rows = []
    for name, changes in (
        ('likelihood_field', {}),
        ('likelihood_field_prob', {}),
        ('  with beam skipping', {'do_beamskip': True}),
        ('beam', {}),
    ):
        model_type = name if not changes else 'likelihood_field_prob'
        model = laser_model(_params(SL, laser_model_type=model_type, **changes), grid)
        particles = _amcl(grid, SL).particles
        beams = model.beams(_thinned(lidar.scan(0, SL.start), 180), IDENTITY)
        cost_ms = _median_ms(lambda: model.likelihoods(particles, beams, True), calls)
        rows.append([name, f'{cost_ms:.2f}'])
    return rows


def _by_map(calls: int) -> List[List[str]]:
    rows = []
    for side_m, cell_m in ((5, 0.05), (10, 0.05), (20, 0.05), (40, 0.05), (80, 0.05), (40, 0.025)):
        cells = round(side_m / cell_m)
        occupied = np.random.default_rng(0).random((cells, cells)) < 0.01
        grid = OccupancyGrid(np.where(occupied, 100, 0).astype(np.int8), cell_m, IDENTITY)
        amcl = _amcl(grid, SL)
        amcl.global_localization()
        scan = _thinned(Scan(0, 0.0, math.radians(2), 0.1, 6.0, np.linspace(0.5, 3.0, 180)), 180)
        model = laser_model(amcl.params, grid)
        beams = model.beams(scan, IDENTITY)
        build_ms = _median_ms(lambda: amcl.set_map(grid), 5)
        weigh_ms = _median_ms(lambda: model.likelihoods(amcl.particles, beams, False), calls)
        rows.append([f'{side_m} x {side_m}', f'{cell_m}', f'{cells * cells}', f'{build_ms:.1f}', f'{weigh_ms:.2f}'])
    return rows


def _as_adapted(name: str, place: Place) -> List[str]:
    """Run a whole test with exact odometry from the paper's initial spread, 1000 rays a scan."""
    lidar, grid = _scanner_and_map(place, 1000)
    amcl, pose, costs_ms, counts = _amcl(grid, place), place.start, [], []
    for _ in range(place.updates):
        scan = lidar.scan(0, pose)
        costs_ms.append(_ms(lambda: amcl.update(pose, scan, IDENTITY)))
        counts.append(len(amcl.particles))
        pose = pose.compose(Pose2D(place.forward_m, 0.0, place.turn_rad))
    return [
        name,
        f'{amcl.update_count}',
        f'{np.median(counts):.0f}',
        f'{max(counts)}',
        f'{np.median(costs_ms):.2f}',
        f'{np.percentile(costs_ms, 95):.2f}',
        f'{max(costs_ms):.2f}',
    ]


def _accuracy(name: str, place: Place, trials: int) -> List[str]:
    """Run trials whose start is off by a draw from the paper's initial spread."""
    lidar, grid = _scanner_and_map(place, 1000)
    errors, variances = [], []
    for trial in range(trials):
        rng = np.random.default_rng([trial, 7])
        off = rng.standard_normal(3) * [0.5, 0.5, math.pi / 12]
        guess = dict(
            initial_pose_x=place.start.x_m + off[0],
            initial_pose_y=place.start.y_m + off[1],
            initial_pose_a=place.start.yaw_rad + off[2],
        )
        amcl, pose = Amcl(_params(place, **guess), grid, rng), place.start
        for _ in range(place.updates):
            estimate = amcl.update(pose, lidar.scan(0, pose), IDENTITY)
            if estimate is not None:
                last, truth = estimate, pose
            pose = pose.compose(Pose2D(place.forward_m, 0.0, place.turn_rad))
        error = np.subtract(last.base_pose_in_map, truth)
        errors.append([error[0], error[1], wrap_angle(error[2])])
        variances.append(np.diag(last.covariance))
    units = np.array([1e3, 1e3, math.degrees(1.0)])
    rms = np.sqrt(np.mean(np.square(errors), axis=0)) * units
    sigmas = np.sqrt(np.mean(variances, axis=0)) * units
    # Nothing but x and y is correlated in what upstream publishes, and these little.
    nees = float(np.mean(np.sum(np.square(errors) / variances, axis=1)))
    return (
        [name]
        + [f'{value:.{digits}f}' for value, digits in zip(rms, (0, 0, 2))]
        + [f'{value:.{digits}f}' for value, digits in zip(sigmas, (0, 0, 2))]
        + [f'{nees:.2f}']
    )


def _print_compile_time() -> None:
    """Time the start of a new process, from import to first estimate, with an empty and a filled cache."""
    for state, spent_s in zip(('compiling', 'compiled'), first_call_s('amcl', 'first_update_s')):
        print(f'first update in a new process, {state}: {spent_s:.2f} s')


def first_update_s() -> float:
    """Time the filter from its construction to its second update."""
    grid = OccupancyGrid(np.zeros((50, 50), np.int8), 0.1, Pose2D(-2.5, -2.5, 0.0))
    grid.cells[0] = 100
    scan = Scan(0, 0.0, 0.1, 0.1, 6.0, np.full(60, 1.0))
    began_s = time.perf_counter()
    amcl = Amcl(AmclParams(), grid, np.random.default_rng(0))
    for _ in range(2):
        _forced(amcl, scan)
    return time.perf_counter() - began_s


def _forced(amcl: Amcl, scan: Scan) -> None:
    amcl.request_nomotion_update()
    amcl.update(IDENTITY, scan, IDENTITY)


def _params(place: Place, **changes: object) -> AmclParams:
    return AmclParams(**{**PAPER, 'initial_pose_x': place.start.x_m, 'initial_pose_y': place.start.y_m, **changes})


def _amcl(grid: OccupancyGrid, place: Place, **changes: object) -> Amcl:
    return Amcl(_params(place, **changes), grid, np.random.default_rng(0))


def _scanner_and_map(place: Place, samples: int) -> Tuple[Lidar, OccupancyGrid]:
    world = load_world(ROOT / 'worlds' / f'{place.world}.world')
    lidar = Lidar(world, SCAN_HEIGHT_M, LidarParams(samples=samples), np.random.default_rng(1))
    return lidar, rasterise(world, SCAN_HEIGHT_M, RESOLUTION_M, place.start.x_m, place.start.y_m)


def _thinned(scan: Scan, beams: int) -> Scan:
    """Return a scan with so many of its rays, all of which return."""
    step = len(scan.ranges_m) // beams
    return scan._replace(
        angle_increment_rad=scan.angle_increment_rad * step, ranges_m=np.minimum(scan.ranges_m[::step][:beams], 3.4)
    )


def _median_ms(call: Callable[[], object], calls: int) -> float:
    call()
    return float(np.median([_ms(call) for _ in range(calls)]))


def _ms(call: Callable[[], object]) -> float:
    began_s = time.perf_counter()
    call()
    return 1e3 * (time.perf_counter() - began_s)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--calls', type=COUNT, default=100, help='of which the median is taken')
    parser.add_argument('--trials', type=COUNT, default=30, help='of each test, for the accuracy')
    return parser.parse_args()


if __name__ == '__main__':
    main()
