#!/usr/bin/env python3
"""Time one scan of the LiDAR: the ray caster beside PyBullet's rayTestBatch on the same
rays, compile time apart, and how both grow with rays and with the world."""

from __future__ import annotations

import argparse
import math
import time
from typing import Callable, List, NamedTuple

import numpy as np
import pybullet
from checkout import ROOT, first_call_s, print_header
from counts import COUNT
from ratios import Ratio, add_json, print_ratios, write_ratios
from tabulate import tabulate

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.world import Box, Cylinder, Model, Plane, Solid, World, load_world

SCAN_HEIGHT_M, RANGE_MAX_M = 1.12, 6.0  # ALTO's
RAYS, PRIMITIVES = (100, 360, 1000, 3600, 10_000), (10, 30, 100, 300, 1000)
POSES = 20
SIDE_M = 20.0  # of the worlds that are made up
MOST = 0.04  # of PyBullet's time: 0.07 ms are 0.012 of it on the machine that the limit is from


class Place(NamedTuple):
    """A shipped world and where poses in it are drawn from: x and y from low to high [m]."""

    name: str
    low_m: tuple
    high_m: tuple


PLACES = (Place('hallway', (-10.0, -1.0), (10.0, 1.0)), Place('ros_logo', (-3.6, -0.9), (-2.8, 0.9)))


class Compared(NamedTuple):
    """A scan by both."""

    rays: int
    solids: int
    ours_ms: List[float]  # by round
    theirs_ms: float  # the best
    difference_mm: float  # of 99 % of the rays

    @property
    def rounds(self) -> List[float]:
        """Return our time in units of theirs."""
        return [ours_ms / self.theirs_ms for ours_ms in self.ours_ms]

    def as_row(self) -> List[str]:
        """Return the columns of a table."""
        return [
            f'{self.rays}',
            f'{self.solids}',
            f'{min(self.ours_ms):.3f}',
            f'{self.theirs_ms:.2f}',
            f'{1.0 / min(self.rounds):.0f}',
            f'{self.difference_mm:.3f}',
        ]


class BulletRays:
    """The same world in PyBullet."""

    def __init__(self, world: World) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        for solid in world.solids:
            if not isinstance(solid.shape, Plane):
                self._add(solid)

    def close(self) -> None:
        """Free PyBullet's world."""
        pybullet.disconnect(physicsClientId=self._client)

    def ranges_m(self, pose: Pose2D, bearings_rad: np.ndarray) -> np.ndarray:
        """Return (n,) distance along each ray, RANGE_MAX_M where nothing is."""
        angles_rad = pose.yaw_rad + bearings_rad
        start = [pose.x_m, pose.y_m, SCAN_HEIGHT_M]
        ends = np.column_stack(
            [
                pose.x_m + RANGE_MAX_M * np.cos(angles_rad),
                pose.y_m + RANGE_MAX_M * np.sin(angles_rad),
                np.full(len(angles_rad), SCAN_HEIGHT_M),
            ]
        ).tolist()
        hits = []
        most = pybullet.MAX_RAY_INTERSECTION_BATCH_SIZE
        for first in range(0, len(ends), most):
            batch = ends[first : first + most]
            hits += pybullet.rayTestBatch([start] * len(batch), batch, physicsClientId=self._client)
        return RANGE_MAX_M * np.array([hit[2] for hit in hits])

    def _add(self, solid: Solid) -> None:
        shape, yaw_rad = solid.shape, math.atan2(*solid.pose_in_world[[1, 0], 0])
        if isinstance(shape, Box):
            kind = dict(shapeType=pybullet.GEOM_BOX, halfExtents=[0.5 * side_m for side_m in shape.size_xyz_m])
        elif isinstance(shape, Cylinder):
            kind = dict(shapeType=pybullet.GEOM_CYLINDER, radius=shape.radius_m, height=shape.length_m)
        else:
            raise TypeError(shape)
        pybullet.createMultiBody(
            0,
            pybullet.createCollisionShape(physicsClientId=self._client, **kind),
            basePosition=solid.pose_in_world[:3, 3].tolist(),
            baseOrientation=pybullet.getQuaternionFromEuler((0.0, 0.0, yaw_rad)),
            physicsClientId=self._client,
        )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=COUNT, default=10, help='rounds over all poses')
    add_json(parser)
    arguments = parser.parse_args()
    repeats = arguments.repeats
    print_header(f'Cost of a scan: best of {repeats} rounds over {POSES} poses, one thread')
    print(
        _table(
            'first scan of a new process',
            ['numba cache', 's'],
            [
                [state, f'{spent_s:.3f}']
                for state, spent_s in zip(('empty', 'filled'), first_call_s('lidar', 'first_scan_s'))
            ],
        )
    )
    shipped = [_compare(_shipped(place.name), _poses(place.low_m, place.high_m), 1000, repeats) for place in PLACES]
    headers = ['rays', 'solids', 'numba\n[ms]', 'PyBullet\n[ms]', 'ratio', 'difference\nof 99 % [mm]']
    print(
        _table(
            'the shipped worlds',
            ['world'] + headers,
            [[place.name, *compared.as_row()] for place, compared in zip(PLACES, shipped)],
        )
    )
    hallway, poses = _shipped('hallway'), _poses(*PLACES[0][1:])
    print(_table('by rays, hallway', headers, [_compare(hallway, poses, rays, repeats).as_row() for rays in RAYS]))
    print(
        _table(
            f'by solids, strewn over {SIDE_M:g} x {SIDE_M:g} m',
            headers,
            [
                _compare(_strewn_world(count), _poses((-2.0, -2.0), (2.0, 2.0)), 1000, repeats).as_row()
                for count in PRIMITIVES
            ],
        )
    )
    print(
        'numba is the exact distances alone; a whole scan with its noise, in the hallway: '
        f'{_scan_ms(hallway, poses, repeats):.3f} ms.\n99 % of the rays agree as shown; of the '
        'others most graze an edge.\n'
    )
    ratios = [
        Ratio(f'a scan of 1000 rays, {place.name}', "PyBullet's rayTestBatch", compared.rounds, MOST)
        for place, compared in zip(PLACES, shipped)
    ]
    print_ratios(ratios)
    write_ratios(arguments.json, ratios)


def _shipped(name: str) -> World:
    return load_world(ROOT / 'worlds' / f'{name}.world')


def first_scan_s() -> float:
    """Return seconds for the first scan in this process: compiling, or loading the compiled code."""
    lidar = Lidar(load_world(ROOT / 'worlds' / 'hallway.world'), SCAN_HEIGHT_M, LidarParams(), np.random.default_rng(0))
    began_s = time.perf_counter()
    lidar.scan(0, Pose2D(0.0, 0.0, 0.0))
    return time.perf_counter() - began_s


def _compare(world: World, poses: List[Pose2D], rays: int, repeats: int) -> Compared:
    params = LidarParams(samples=rays, range_max=RANGE_MAX_M)
    lidar = Lidar(world, SCAN_HEIGHT_M, params, np.random.default_rng(0))
    bearings_rad = params.angle_min + params.angle_span / rays * np.arange(rays)
    bullet = BulletRays(world)
    try:
        differences_m = np.concatenate(
            [
                np.abs(np.minimum(lidar.true_ranges_m(pose), RANGE_MAX_M) - bullet.ranges_m(pose, bearings_rad))
                for pose in poses
            ]
        )
        theirs_ms = _rounds_ms(lambda pose: bullet.ranges_m(pose, bearings_rad), poses, max(1, repeats // 5))
        ours_ms = _rounds_ms(lidar.true_ranges_m, poses, repeats)
    finally:
        bullet.close()
    solids = sum(not isinstance(solid.shape, Plane) for solid in world.solids)
    return Compared(rays, solids, ours_ms, min(theirs_ms), 1e3 * float(np.percentile(differences_m, 99)))


def _scan_ms(world: World, poses: List[Pose2D], repeats: int) -> float:
    lidar = Lidar(world, SCAN_HEIGHT_M, LidarParams(), np.random.default_rng(0))
    return min(_rounds_ms(lambda pose: lidar.scan(0, pose), poses, repeats))


def _rounds_ms(cast: Callable[[Pose2D], object], poses: List[Pose2D], repeats: int) -> List[float]:
    """Return the mean processor time over the poses [ms] of each round; the fastest is the least disturbed."""
    rounds_s = []
    for _ in range(repeats):
        began_s = time.process_time()
        for pose in poses:
            cast(pose)
        rounds_s.append(time.process_time() - began_s)
    return [1e3 * round_s / len(poses) for round_s in rounds_s]


def _poses(low_m: tuple, high_m: tuple) -> List[Pose2D]:
    rng = np.random.default_rng(7)
    return [Pose2D(*rng.uniform(low_m, high_m), rng.uniform(-math.pi, math.pi)) for _ in range(POSES)]


def _strewn_world(count: int) -> World:
    """Build boxes and pillars by turns, none within 2.5 m of the poses in the middle."""
    rng, solids = np.random.default_rng(3), []
    while len(solids) < count:
        pose = np.eye(4)
        pose[:3, 3] = [*rng.uniform(-0.5 * SIDE_M, 0.5 * SIDE_M, 2), 1.0]
        if max(abs(pose[:2, 3])) < 3.0:
            continue
        yaw_rad = rng.uniform(-math.pi, math.pi)
        pose[:2, :2] = [[math.cos(yaw_rad), -math.sin(yaw_rad)], [math.sin(yaw_rad), math.cos(yaw_rad)]]
        shape = Box((0.3, 0.2, 2.0)) if len(solids) % 2 else Cylinder(0.15, 2.0)
        solids.append(Solid(f'strewn/{len(solids)}', shape, pose))
    return World('strewn', [Model('strewn', np.eye(4), solids)])


def _table(title: str, headers: List[str], rows: List[List[str]]) -> str:
    return f'{title}\n\n' + tabulate(rows, headers, disable_numparse=True, stralign='right') + '\n'


if __name__ == '__main__':
    main()
