#!/usr/bin/env python3
"""Measure lost detection: fractions of fitting rays at right and wrong poses and among people, and how often
the filter ends lost, right or wrong. Takes a minute.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from typing import Callable, Dict, Iterator, List, Tuple

import numpy as np
from checkout import ROOT, print_header
from counts import COUNT
from tabulate import tabulate

sys.path.insert(0, str(ROOT / 'test' / 'support'))

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.likelihood_field import distance_field
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OccupancyGrid
from diff_encoder_sim.localization.scan_fit import FitMap
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.world import load_world
from grid_cells import cell_centre

SCAN_HEIGHT_M, CLEARANCE_M = 1.12, 0.45
STARTS = {'hallway': (-10.0, 0.0), 'ros_logo': (-3.4, -0.85)}
SURE, GUESS = np.diag([0.0025] * 3), np.diag([0.25, 0.25, (math.pi / 12) ** 2])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--poses', type=COUNT, default=300, help='for the fractions')
    parser.add_argument('--runs', type=COUNT, default=60, help='for the filter')
    arguments = parser.parse_args()
    print_header('Lost detection')
    for name in STARTS:
        Place(name, arguments.poses).print_fractions()
        Place(name, 2 * arguments.runs).print_runs()


class Place:
    """A world with free poses that the robot can reach, and scans from there."""

    def __init__(self, name: str, count: int) -> None:
        self.name, self.grid = name, load_map(ROOT / 'worlds' / f'{name}.yaml')
        self.rng = np.random.default_rng(1)
        self.lidar = Lidar(load_world(ROOT / 'worlds' / f'{name}.world'), SCAN_HEIGHT_M, LidarParams(), self.rng)
        self.params = load_yaml(ROOT / 'config' / 'amcl.yaml')
        self.poses = free_poses(self.grid, STARTS[name], count, self.rng)

    # ---- fractions of rays

    def print_fractions(self) -> None:
        """Print quantiles of the fraction of rays that fit, and how often it is below lost_fraction."""
        scans = [self.lidar.scan(0, pose) for pose in self.poses]
        rows: List[Tuple[str, List[Scan], Callable[[Pose2D], Pose2D]]] = [('within 10 cm, 3 deg', scans, self._near)]
        for part in (1 / 3, 1 / 2, 2 / 3):
            blocked = [block(scan, part, self.rng) for scan in scans]
            rows.append((f'{part:.2f} of the view: people', blocked, self._near))
        rows += [(f'{off_m} m off', scans, self._off(off_m)) for off_m in (0.3, 0.5, 1.0, 2.0)]
        rows += [(f'{off_m} m off along x', scans, self._along(off_m)) for off_m in (1.0, 2.0, 4.0)]
        rows += [(f'{turn} deg off', scans, self._turned(turn)) for turn in (15, 30, 90, 180)]
        rows.append(('anywhere', scans, lambda _: self.poses[self.rng.integers(len(self.poses))]))
        fit_map = FitMap(self.grid, self.params['lost_distance'])
        print(f'\n{self.name}: fraction of rays that fit')
        table = []
        for title, taken, estimated in rows:
            fits = [fit_map.fit(estimated(pose), scan, IDENTITY).fraction for pose, scan in zip(self.poses, taken)]
            fractions = np.array([fraction for fraction in fits if fraction is not None])
            table.append(
                [
                    title,
                    *np.quantile(fractions, [0, 0.01, 0.05, 0.5, 0.95, 0.99]),
                    (fractions < self.params['lost_fraction']).mean(),
                ]
            )
        print(tabulate(table, ['', 'min', '1 %', '5 %', '50 %', '95 %', '99 %', 'bad'], floatfmt='.2f'))
        begin_s = time.perf_counter()
        for pose, scan in zip(self.poses, scans):
            fit_map.fit(pose._replace(yaw_rad=pose.yaw_rad + 1.0), scan, IDENTITY)
        print(f'{(time.perf_counter() - begin_s) / len(scans) * 1e6:.0f} us a scan that fits badly')

    def _near(self, pose: Pose2D) -> Pose2D:
        return turned(moved(pose, 0.1 * math.sqrt(self.rng.random()), self._angle()), self.rng.uniform(-3.0, 3.0))

    def _off(self, off_m: float) -> Callable[[Pose2D], Pose2D]:
        return lambda pose: moved(pose, off_m, self._angle())

    def _along(self, off_m: float) -> Callable[[Pose2D], Pose2D]:
        return lambda pose: moved(pose, off_m, self.rng.choice([0.0, math.pi]))

    def _turned(self, degrees: float) -> Callable[[Pose2D], Pose2D]:
        return lambda pose: turned(pose, degrees * self.rng.choice([-1, 1]))

    def _angle(self) -> float:
        return self.rng.uniform(-math.pi, math.pi)

    # ---- the filter, the robot standing or turned by hand

    def print_runs(self) -> None:
        """Print how many runs end lost; of the others, how many are right, and how many over 1 m off."""
        ends: Dict[str, List[Tuple[bool, float, float]]] = {}
        half = len(self.poses) // 2
        for seed, (here, there) in enumerate(zip(self.poses[:half], self.poses[half:])):
            for title, end in self._ends(here, there, seed):
                ends.setdefault(title, []).append(end)
        table = []
        for title, found in ends.items():
            not_lost = [end for end in found if not end[0]]
            right = sum(off_m < 0.3 and off_deg < 10.0 for _, off_m, off_deg in not_lost)
            wrong = sum(off_m > 1.0 for _, off_m, _ in not_lost)
            table.append([title, len(found) - len(not_lost), right, len(not_lost) - right - wrong, wrong])
        print(f'\n{self.name}: {half} runs each')
        print(tabulate(table, ['', 'lost', 'within 0.3 m, 10 deg', 'between', 'over 1 m off']))

    def _ends(self, here: Pose2D, there: Pose2D, seed: int) -> Iterator[Tuple[str, Tuple[bool, float, float]]]:
        drawn = self.rng.standard_normal(3) * np.sqrt(np.diag(GUESS))
        off = Pose2D(*np.add(here, drawn).tolist())
        yield 'guess off by its sigmas', self._stand(self._begun(seed, off, GUESS), here, 100)
        off = moved(here, 2.0, self._angle())
        yield 'guess 2 m off, of 0.5 m sigma', self._stand(self._begun(seed, off, GUESS), here, 100)
        yield 'guess 2 m off, of 5 cm sigma', self._stand(self._begun(seed, off, SURE), here, 100)
        amcl = self._carried(seed, here, there)
        yield 'carried elsewhere', end_of(amcl, IDENTITY, there)
        yield 'then turned by hand', self._turn(self._carried(seed, here, there), there)
        yield 'then carried back', self._stand(amcl, here, 20)
        self._stand(amcl, there, 30)
        amcl.set_pose(moved(there, 0.25, self._angle()), GUESS)
        yield 'carried elsewhere, given a pose 0.25 m off', self._stand(amcl, there, 60)
        amcl.global_localization()
        yield 'global localization, standing', self._stand(amcl, there, 100)
        amcl.global_localization()
        yield 'global localization, turned by hand', self._turn(amcl, there)

    def _begun(self, seed: int, pose: Pose2D, covariance: np.ndarray) -> Amcl:
        amcl = Amcl(AmclParams(**self.params), self.grid, np.random.default_rng(seed))
        amcl.set_pose(pose, covariance)
        return amcl

    def _carried(self, seed: int, here: Pose2D, there: Pose2D) -> Amcl:
        amcl = self._begun(seed, here, SURE)
        self._stand(amcl, here, 3)
        self._stand(amcl, there, 30)
        return amcl

    def _stand(self, amcl: Amcl, true_pose: Pose2D, scans: int) -> Tuple[bool, float, float]:
        for _ in range(scans):
            amcl.update(IDENTITY, self.lidar.scan(0, true_pose), IDENTITY)
        return end_of(amcl, IDENTITY, true_pose)

    def _turn(self, amcl: Amcl, true_pose: Pose2D) -> Tuple[bool, float, float]:
        odom_pose = IDENTITY
        for _ in range(200):
            true_pose, odom_pose = (turned(pose, 8.6) for pose in (true_pose, odom_pose))
            amcl.update(odom_pose, self.lidar.scan(0, true_pose), IDENTITY)
        return end_of(amcl, odom_pose, true_pose)


def end_of(amcl: Amcl, odom_pose: Pose2D, true_pose: Pose2D) -> Tuple[bool, float, float]:
    """Return whether the robot is lost, and its estimate's error [m, degrees]."""
    pose = amcl.odom_pose_in_map.compose(odom_pose)
    return (
        amcl.is_lost,
        math.hypot(pose.x_m - true_pose.x_m, pose.y_m - true_pose.y_m),
        abs(math.degrees(wrap_angle(pose.yaw_rad - true_pose.yaw_rad))),
    )


def moved(pose: Pose2D, off_m: float, direction_rad: float) -> Pose2D:
    """Return the pose shifted in the map's frame."""
    return Pose2D(pose.x_m + off_m * math.cos(direction_rad), pose.y_m + off_m * math.sin(direction_rad), pose.yaw_rad)


def turned(pose: Pose2D, degrees: float) -> Pose2D:
    """Return the pose turned on the spot."""
    return pose._replace(yaw_rad=wrap_angle(pose.yaw_rad + math.radians(degrees)))


def block(scan: Scan, part: float, rng: np.random.Generator) -> Scan:
    """Return the scan among people, half a metre wide and 0.5 to 2 m away, in this part of the view."""
    count = len(scan.ranges_m)
    nearest_m = np.full(count, np.inf)
    while np.isfinite(nearest_m).mean() < part:
        away_m = rng.uniform(0.5, 2.0)
        width = int(count * math.atan2(0.25, away_m) / math.pi)
        rays = (rng.integers(count) + np.arange(width)) % count
        nearest_m[rays] = np.minimum(nearest_m[rays], away_m)
    return scan._replace(ranges_m=np.minimum(scan.ranges_m, nearest_m))


def free_poses(grid: OccupancyGrid, start: Tuple[float, float], count: int, rng: np.random.Generator) -> List[Pose2D]:
    """Draw poses where the robot fits and that it can reach from the start."""
    field = distance_field(grid.cells != FREE, grid.resolution_m, 1.0)
    fits = field.distances_m[field.indices] > CLEARANCE_M
    reached, edge = {grid.cell_at(*start)}, [grid.cell_at(*start)]
    while edge:
        row, column = edge.pop()
        for cell in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            if fits[cell] and cell not in reached:
                reached.add(cell)
                edge.append(cell)
    cells = sorted(reached)
    return [
        Pose2D(*cell_centre(grid, *cells[index]), rng.uniform(-math.pi, math.pi))
        for index in rng.integers(0, len(cells), count)
    ]


if __name__ == '__main__':
    main()
