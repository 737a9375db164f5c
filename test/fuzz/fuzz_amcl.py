"""AMCL: odd parameters, maps, scans, poses, covariances and stamps, in any order."""

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from odd_values import odd_float, odd_mapping, pick
from sandbox import Fault

STEPS = 12
GOOD = {
    **{key: value for key, value in AmclParams().model_dump().items() if not key.startswith(('gui', 'bag', 'std_'))},
    'max_particles': 300, 'laser_max_beams': 30, 'update_min_d': 0.01, 'resample_interval': 1, 'lost_fraction': 0.3,
}  # fmt: skip
MODELS = ('likelihood_field', 'likelihood_field_prob', 'beam')


def warm_up(folder):
    for model in MODELS:
        amcl = Amcl(AmclParams(**{**GOOD, 'laser_model_type': model}), _room(), np.random.default_rng(0))
        for step in range(4):
            amcl.update(Pose2D(0.1 * step, 0.0, 0.0), _scan(np.full(60, 1.5)), IDENTITY)


def run(rng, folder):
    given = {**GOOD, 'laser_model_type': pick(rng, MODELS), 'do_beamskip': bool(rng.integers(2))}
    params = AmclParams.from_mapping(odd_mapping(rng, given) if rng.random() < 0.7 else given, 'amcl')
    grid = _odd_grid(rng) if rng.random() < 0.5 else _room()
    amcl = Amcl(params, grid, np.random.default_rng(1))
    pose = IDENTITY
    for step in range(STEPS):
        pose = pose.compose(Pose2D(0.1, 0.0, 0.1))
        try:
            _act(rng, amcl, pose if rng.random() < 0.8 else _odd_pose(rng), step)
        except InputFault as fault:
            _check_line(fault)
        _check(amcl)


def _act(rng, amcl, pose, step):
    action = rng.random()
    if action < 0.7:
        scan = _scan(np.full(60, 1.5), step) if rng.random() < 0.4 else _odd_scan(rng, step)
        amcl.update(pose, scan, IDENTITY if rng.random() < 0.8 else _odd_pose(rng))
    elif action < 0.8:
        amcl.set_pose(_odd_pose(rng), np.array([[odd_float(rng, 0.1) for _ in range(3)] for _ in range(3)]))
    elif action < 0.87:
        amcl.set_map(_odd_grid(rng))
    elif action < 0.94:
        amcl.global_localization()
    else:
        amcl.request_nomotion_update()


def _check(amcl):
    estimate = amcl.last_estimate
    numbers = [amcl.particles, amcl.weights]
    if estimate is not None:
        numbers += [estimate.base_pose_in_map, estimate.covariance, estimate.odom_pose_in_map, estimate.cluster_weight]
    if not all(np.isfinite(part).all() for part in numbers):
        raise Fault(f'not finite: {estimate}')
    if abs(amcl.weights.sum() - 1.0) > 1e-6:
        raise Fault(f'the weights sum to {amcl.weights.sum()}')


def _check_line(fault):
    if len(str(fault).splitlines()) != 1:
        raise Fault(f'not one line: {fault}')


def _odd_pose(rng):
    return Pose2D(*(odd_float(rng, 0.5) if rng.random() < 0.5 else rng.normal() for _ in range(3)))


def _scan(ranges_m, step=0):
    count = max(1, len(ranges_m))
    return Scan(step * 100_000_000, -np.pi, 2 * np.pi / count, 0.1, 6.0, ranges_m)


def _odd_scan(rng, step):
    count = int(pick(rng, (0, 1, 2, 7, 60, 1000, 5000)))
    ranges_m = rng.uniform(0.0, 8.0, count)
    for value in (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300):
        ranges_m[rng.random(count) < rng.random() * 0.5] = value
    scan = _scan(ranges_m, step)
    field = pick(rng, ('angle_min_rad', 'angle_increment_rad', 'range_min_m', 'range_max_m', None))
    if field:
        scan = scan._replace(**{field: odd_float(rng, getattr(scan, field))})
    return scan._replace(stamp_ns=int(pick(rng, (scan.stamp_ns, 0, -1, 2**62))))


def _room():
    cells = np.zeros((80, 80), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    return OccupancyGrid(cells, 0.05, Pose2D(-2.0, -2.0, 0.0))


def _odd_grid(rng):
    height, width = (int(side) for side in rng.integers(0, pick(rng, (3, 100, 400)), 2))
    cells = rng.choice(np.array([0, 100, -1, 50, -128], np.int8), (height, width), p=[0.7, 0.1, 0.1, 0.05, 0.05])
    if rng.random() < 0.3:
        cells[:] = pick(rng, (0, 100, -1))
    origin = _odd_pose(rng) if rng.random() < 0.4 else Pose2D(-1.0, -1.0, 0.3)
    return OccupancyGrid(cells, odd_float(rng, 0.05) if rng.random() < 0.4 else 0.05, origin)
