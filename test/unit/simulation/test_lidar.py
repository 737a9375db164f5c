"""The scanner against geometry by hand, brute force, and its own noise."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.xml_values import rotation_from_rpy
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams, cut_world
from diff_encoder_sim.simulation.world import Box, Cylinder, Model, Solid, Sphere, World, load_world
from places import WORLDS
from robot_parts import pose

HEIGHT_M = 1.12


def solid(shape, x_m=0.0, y_m=0.0, z_m=1.0):
    return Solid('m/l/c', shape, pose((x_m, y_m, z_m)))


def lidar(solids, seed=0, **params):
    world = World('w', [Model('m', np.eye(4), list(solids))])
    return Lidar(world, HEIGHT_M, LidarParams(**{'noise': 0.0, **params}), np.random.default_rng(seed))


ROOM = [
    solid(Box((0.2, 10.0, 2.0)), x_m=3.1),
    solid(Box((0.2, 10.0, 2.0)), x_m=-2.1),
    solid(Box((10.0, 0.2, 2.0)), y_m=2.1),
    solid(Box((10.0, 0.2, 2.0)), y_m=-1.1),
]


def test_solids_are_cut_at_the_scan_height():
    ranges_m = lidar([solid(Cylinder(0.5, 2.0), x_m=2.0)], samples=3600).true_ranges_m(Pose2D(0.0, 0.0, 0.0))
    assert ranges_m.min() == pytest.approx(1.5, abs=1e-6)
    assert np.isfinite(ranges_m).sum() * 2 * math.pi / 3600 == pytest.approx(2 * math.asin(0.25), abs=0.004)
    _, circles = cut_world(World('w', [Model('m', np.eye(4), [solid(Sphere(0.5), z_m=HEIGHT_M - 0.3)])]), HEIGHT_M)
    assert circles == pytest.approx(np.array([[0, 0, 0.4]]))
    above_and_below = lidar([solid(Box((1, 1, 1.0)), x_m=2, z_m=0.5), solid(Cylinder(1, 1.0), x_m=-3, z_m=2.0)])
    assert np.isinf(above_and_below.true_ranges_m(Pose2D(0, 0, 0))).all()
    leaning = solid(Box((1, 1, 2)))
    leaning.pose_in_world[:3, :3] = rotation_from_rpy(0.2, 0, 0)
    with pytest.raises(ConfigError, match='m/l/c: leans'):
        lidar([leaning])


def brute_force_m(scanner, pose, bearings_rad):
    ranges_m = np.full(len(bearings_rad), np.inf)
    for index, bearing in enumerate(bearings_rad):
        dx, dy = math.cos(bearing), math.sin(bearing)
        for x0, y0, x1, y1 in scanner._segments - np.tile([pose.x_m, pose.y_m], 2):
            across = dx * (y1 - y0) - dy * (x1 - x0)
            if across:
                away, fraction = (x0 * (y1 - y0) - y0 * (x1 - x0)) / across, (x0 * dy - y0 * dx) / across
                if away >= 0 and 0 <= fraction <= 1:
                    ranges_m[index] = min(ranges_m[index], away)
        for x, y, radius in scanner._circles - [pose.x_m, pose.y_m, 0]:
            along, root = x * dx + y * dy, (x * dx + y * dy) ** 2 - x * x - y * y + radius**2
            if root >= 0:
                for away in (along - math.sqrt(root), along + math.sqrt(root)):
                    if away >= 0:
                        ranges_m[index] = min(ranges_m[index], away)
    return ranges_m


@pytest.mark.parametrize('name', ['hallway', 'ros_logo'])
@pytest.mark.parametrize(('angle_min', 'angle_span'), [(-math.pi, 2 * math.pi), (-1.0, 2.5), (2.0, 5.0)])
def test_the_shipped_worlds_against_brute_force(name, angle_min, angle_span):
    params = LidarParams(samples=97, angle_min=angle_min, angle_span=angle_span)
    scanner = Lidar(load_world(WORLDS / f'{name}.world'), HEIGHT_M, params, np.random.default_rng(0))
    rng = np.random.default_rng(3)
    for _ in range(6):
        pose = Pose2D(*rng.uniform(-2.5, 2.5, 2), rng.uniform(-7, 7))
        bearings_rad = pose.yaw_rad + angle_min + angle_span / 97 * np.arange(97)
        assert scanner.true_ranges_m(pose) == pytest.approx(brute_force_m(scanner, pose, bearings_rad), abs=1e-9)


def test_each_ray_is_measured_with_its_own_noise_and_then_cut_to_the_limits():
    params = dict(noise=0.5, range_min=0.9, range_max=2.5)
    scanner, pose = lidar(ROOM, seed=4, **params), Pose2D(0.2, 0.1, 0.3)
    true_m = scanner.true_ranges_m(pose)
    noisy_m = true_m + 0.5 * np.random.default_rng(4).standard_normal(1000)
    expected = np.where((true_m > 2.5) | (noisy_m > 2.5), np.inf, np.where(noisy_m < 0.9, -np.inf, noisy_m))
    scan = scanner.scan(7, pose)
    assert (scan.stamp_ns, scan.range_max_m, scan.ranges_m.tolist()) == (7, 2.5, expected.tolist())
    assert scan.bearings_rad()[::250] == pytest.approx([-math.pi, -math.pi / 2, 0, math.pi / 2])
    assert lidar(ROOM, seed=5, **params).scan(0, pose).ranges_m.tolist() != expected.tolist()
    assert 50 < np.isneginf(expected).sum() < 500 and 50 < np.isposinf(expected).sum() < 900


def test_a_range_that_ends_before_it_begins_is_named():
    with pytest.raises(ConfigError, match='range_min below range_max'):
        LidarParams.from_mapping({'range_min': 7.0}, 'lidar.yaml')
    assert LidarParams(rate=3.0).period_ns == 333_333_333
