import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.meshes import in_words, mesh_hull, primitives_of, visual_primitives_of
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Mesh, Shape, Sphere
from robot_parts import (
    CUBE_CORNERS,
    CUBE_TRIANGLES,
    WRITERS,
    finder,
    link,
    mesh_shape,
    pose,
    random_rotation,
    shape,
    write_obj,
)


def write_points(path, points_m):
    """Write triangles that have these corners."""
    first = np.arange(len(points_m))
    write_obj(path, points_m, np.stack([first, np.roll(first, 1), np.roll(first, 2)], axis=1))


def hull_of(folder, points_m, **placement):
    write_points(folder / 'a.obj', points_m)
    return mesh_hull(mesh_shape('package://p/a.obj', **placement), 'my.urdf', finder(folder))


def drum_points_m(axis=2, sides=24):
    bearings_rad = np.arange(sides) * 2 * np.pi / sides
    rim = 33 * np.stack([np.cos(bearings_rad), np.sin(bearings_rad)], axis=1)
    points = np.vstack([np.column_stack([rim, np.full(sides, z)]) for z in (-9, 9)])
    return np.roll(points, axis + 1, axis=1)


@pytest.mark.parametrize('name', sorted(WRITERS))
def test_a_cube_of_every_format_becomes_a_box(tmp_path, name):
    WRITERS[name](tmp_path / name, CUBE_CORNERS, CUBE_TRIANGLES)
    part = link('base', collisions=[mesh_shape(f'package://p/meshes/{name}', 0.1, (1, 2, 3))])
    found = primitives_of(part, 'my.urdf', finder(tmp_path))
    assert found.shapes[0].geometry == Box((0.2, 0.2, 0.2))
    assert found.shapes[0].pose_in_link == pytest.approx(pose((1, 2, 3)))
    assert found.notes == (f'collision mesh {name} of link base is simulated as a box of 200 x 200 x 200 mm',)


@pytest.mark.parametrize('axis', [0, 1, 2])
def test_a_wheel_becomes_a_cylinder_along_its_axis(tmp_path, axis):
    hull = hull_of(tmp_path, drum_points_m(axis), scale=1e-3)
    assert hull.geometry == Cylinder(0.033, 0.018)
    assert np.abs(hull.pose_in_link[:3, 2]) == pytest.approx(np.eye(3)[axis])
    assert np.linalg.det(hull.pose_in_link[:3, :3]) == pytest.approx(1)
    assert in_words(hull.geometry) == 'a cylinder of radius 33 mm, length 18 mm'


def test_a_ball_becomes_a_sphere(tmp_path):
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    hull = hull_of(tmp_path, 0.02 * np.vstack([directions, -directions]) + [1, 2, 3])
    assert isinstance(hull.geometry, Sphere)
    assert in_words(hull.geometry) == 'a sphere of radius 20 mm'
    assert hull.pose_in_link == pytest.approx(pose((1, 2, 3)))


def test_the_origin_of_the_collision_moves_and_turns_the_hull(tmp_path):
    hull = hull_of(tmp_path, drum_points_m(), scale=1e-3, xyz_m=(1, 2, 3), rpy_rad=(math.pi / 2, 0, 0))
    assert hull.pose_in_link[:3, 3] == pytest.approx([1, 2, 3])
    assert np.abs(hull.pose_in_link[:3, 2]) == pytest.approx([0, 1, 0])


def test_a_box_that_is_modelled_along_its_own_axes_keeps_them(tmp_path):
    hull = hull_of(tmp_path, CUBE_CORNERS * [3, 1, 0.5], rpy_rad=(0, 0, 0.5))
    assert hull.geometry == Box((6, 2, 1))
    assert hull.pose_in_link == pytest.approx(pose(rpy_rad=(0, 0, 0.5)))


def test_a_box_that_its_origin_turns_upright_is_along_the_link(tmp_path):
    tilted = CUBE_CORNERS * [3, 1, 0.5] @ pose(rpy_rad=(0, 0, 0.5))[:3, :3].T
    hull = hull_of(tmp_path, tilted, rpy_rad=(0, 0, -0.5))
    assert hull.geometry == Box((6, 2, 1))
    assert hull.pose_in_link == pytest.approx(np.eye(4))


def test_the_scale_may_differ_by_axis_and_mirror(tmp_path):
    write_points(tmp_path / 'a.obj', CUBE_CORNERS + [1, 0, 0])
    hull = mesh_hull(Shape(Mesh('a.obj', (-1.0, 2.0, 3.0)), np.eye(4)), 'my.urdf', finder(tmp_path))
    assert hull.geometry == Box((2, 4, 6))
    assert hull.pose_in_link == pytest.approx(pose((-1, 0, 0)))


def test_hulls_of_random_meshes_hold_every_corner(tmp_path):
    rng = np.random.default_rng(5)
    for _ in range(30):
        points_m = rng.normal(size=(12, 3)) * rng.uniform(0.01, 1, 3) @ random_rotation(rng).T
        placement = dict(xyz_m=rng.normal(size=3), rpy_rad=rng.normal(size=3))
        hull = hull_of(tmp_path, points_m, **placement)
        in_link_m = points_m @ pose(**placement)[:3, :3].T + placement['xyz_m']
        assert _excess_m(hull, in_link_m) < 2e-6
        (tmp_path / 'a.obj').unlink()


def test_a_flat_sheet_becomes_a_plate_of_1_mm(tmp_path):
    assert hull_of(tmp_path, CUBE_CORNERS * [1, 1, 0]).geometry == Box((2, 2, 0.001))


@pytest.mark.parametrize('size', [(0, 0, 0), (1, 0, 0)])
def test_a_mesh_without_extent_is_one_line(tmp_path, size):
    with pytest.raises(ConfigError, match='^my.urdf: collision mesh .* given a mesh without extent; allowed: [^\n]*$'):
        hull_of(tmp_path, CUBE_CORNERS * size)


def test_shapes_that_are_no_meshes_stay(tmp_path):
    shapes = (shape(Box((1, 2, 3))), shape(Sphere(1)))
    assert primitives_of(link('base', collisions=shapes), 'my.urdf', finder(tmp_path)) == (shapes, ())


def test_a_missing_collision_mesh_is_one_line_that_names_file_link_and_mesh(tmp_path):
    part = link('base', collisions=[mesh_shape('package://p/a.stl')])
    with pytest.raises(ConfigError) as caught:
        primitives_of(part, 'my.urdf', finder(tmp_path))
    assert str(caught.value).startswith(
        "my.urdf: link 'base': collision mesh 'package://p/a.stl': given a file that is missing"
    )


def test_a_missing_visual_mesh_is_no_error(tmp_path):
    part = link('base', visuals=[mesh_shape('package://p/a.stl'), shape(Sphere(1))])
    assert [each.geometry for each in visual_primitives_of(part, finder(tmp_path))] == [Sphere(1)]


def _excess_m(hull, points_m):
    """How far points are outside a shape, along the shape's own axes."""
    local_m = (points_m - hull.pose_in_link[:3, 3]) @ hull.pose_in_link[:3, :3]
    if isinstance(hull.geometry, Box):
        return (np.abs(local_m) - np.array(hull.geometry.size_xyz_m) / 2).max()
    if isinstance(hull.geometry, Sphere):
        return (np.linalg.norm(local_m, axis=1) - hull.geometry.radius_m).max()
    radial_m = np.hypot(local_m[:, 0], local_m[:, 1]) - hull.geometry.radius_m
    return max(radial_m.max(), (np.abs(local_m[:, 2]) - hull.geometry.length_m / 2).max())
