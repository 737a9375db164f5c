import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import Box, Cylinder, Mesh, Shape, Sphere
from diff_encoder_sim.robots.meshes import (
    file_corners_m,
    in_words,
    is_listed,
    link_corners_m,
    listed_mesh,
    mesh_hull,
    mesh_points_m,
    primitives_of,
)
from robot_parts import (
    CUBE_CORNERS,
    CUBE_TRIANGLES,
    WRITERS,
    finder,
    link,
    mesh_shape,
    pose,
    random_rotation,
    write_dae,
    write_obj,
)

WHERE = "my.urdf: link 'base': collision mesh 'a.stl'"


def extents_m(points_m):
    return np.array([points_m.min(axis=0), points_m.max(axis=0)])


@pytest.mark.parametrize('name', sorted(WRITERS))
def test_every_format_gives_the_corners(tmp_path, name):
    WRITERS[name](tmp_path / name, CUBE_CORNERS * [1, 2, 3] + [4, 5, 6], CUBE_TRIANGLES)
    assert extents_m(mesh_points_m(tmp_path / name, WHERE)) == pytest.approx(np.array([[3, 3, 3], [5, 7, 9]]))


@pytest.mark.parametrize('name', ['text.stl', 'part.obj', 'binary.stl'])
@pytest.mark.parametrize('word', ['Gehäuse'.encode('latin-1')])
def test_names_in_a_mesh_may_be_in_any_encoding(tmp_path, name, word):
    WRITERS[name](tmp_path / name, CUBE_CORNERS, CUBE_TRIANGLES)
    content = (tmp_path / name).read_bytes()
    named = {'text.stl': content.replace(b'part', word), 'part.obj': b'# ' + word + b'\n' + content}
    (tmp_path / name).write_bytes(named.get(name, word + content[len(word) :]))
    assert extents_m(mesh_points_m(tmp_path / name, WHERE)) == pytest.approx(extents_m(CUBE_CORNERS))


def test_a_corner_that_no_triangle_has_does_not_count(tmp_path):
    stray = np.vstack([CUBE_CORNERS, [9, 9, 9]])
    for name, write in (('a.obj', write_obj), ('a.dae', write_dae)):
        write(tmp_path / name, stray, CUBE_TRIANGLES)
        assert mesh_points_m(tmp_path / name, WHERE).max() == 1


def test_a_dae_is_scaled_by_its_unit(tmp_path):
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS, CUBE_TRIANGLES, unit_m=0.0254)
    assert extents_m(mesh_points_m(tmp_path / 'a.dae', WHERE)) == pytest.approx(0.0254 * extents_m(CUBE_CORNERS))


@pytest.mark.parametrize('up_axis', ['X_UP', 'Y_UP', 'Z_UP'])
def test_the_up_axis_of_a_dae_is_left_alone_as_rviz_and_gazebo_do(tmp_path, up_axis):
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS * [1, 2, 3], CUBE_TRIANGLES, up_axis=up_axis)
    assert mesh_points_m(tmp_path / 'a.dae', WHERE).max(axis=0).tolist() == [1, 2, 3]


def test_nodes_of_a_dae_move_what_they_show(tmp_path):
    node = '<translate>10 0 0</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>'
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS, CUBE_TRIANGLES, node=node)
    found = extents_m(mesh_points_m(tmp_path / 'a.dae', WHERE))
    assert found == pytest.approx(np.array([[9, -2, -1], [11, 2, 1]]), abs=1e-5)


def test_a_part_of_a_dae_whose_material_is_missing_counts(tmp_path):
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS, CUBE_TRIANGLES)
    bound = '<technique_common><instance_material symbol="m" target="#m"/></technique_common>'
    shown = f'url="#part"><bind_material>{bound}</bind_material></instance_geometry>'
    text = (tmp_path / 'a.dae').read_text().replace('url="#part"/>', shown)
    (tmp_path / 'b.dae').write_text(text)
    assert mesh_points_m(tmp_path / 'b.dae', WHERE).max() == 1


def test_an_edited_mesh_is_read_again(tmp_path):
    write_obj(tmp_path / 'a.obj', CUBE_CORNERS, CUBE_TRIANGLES)
    mesh_points_m(tmp_path / 'a.obj', WHERE)
    write_obj(tmp_path / 'a.obj', 2 * CUBE_CORNERS, CUBE_TRIANGLES)
    assert mesh_points_m(tmp_path / 'a.obj', WHERE).max() == 2


BROKEN = {
    'empty.stl': b'',
    'words.dae': b'this is no mesh at all',
    'no_triangles.obj': b'v 0 0 0\nv 1 0 0\nv 0 1 0\n',
    'wrong_index.obj': b'v 0 0 0\nv 1 0 0\nf 1 2 7\n',
    'other.dae': b'<robot/>',
    'html.stl': b'<!DOCTYPE html><html>404: Not Found</html>' * 9,
}


@pytest.mark.parametrize('name', sorted(BROKEN))
def test_a_broken_mesh_is_one_line_that_names_it(tmp_path, name, capfd, caplog):
    (tmp_path / name).write_bytes(BROKEN[name])
    assert_one_line(tmp_path / name)
    assert capfd.readouterr() == ('', '')


def test_a_missing_file_and_an_unknown_format_are_one_line(tmp_path):
    assert 'which is no file' in assert_one_line(tmp_path / 'a.stl')
    (tmp_path / 'a.step').write_text('')
    assert "given '.step'; allowed: .stl, .obj, .dae" in assert_one_line(tmp_path / 'a.step')
    assert 'which is no file' in assert_one_line(tmp_path)


def assert_one_line(path):
    with pytest.raises(ConfigError) as caught:
        mesh_points_m(path, WHERE)
    text = str(caught.value)
    assert text.startswith(f'{WHERE}: given ')
    assert '; allowed: ' in text
    assert len(text.splitlines()) == 1
    assert len(text) < 400
    return text


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


def _excess_m(hull, points_m):
    """How far points are outside a shape, along the shape's own axes."""
    local_m = (points_m - hull.pose_in_link[:3, 3]) @ hull.pose_in_link[:3, :3]
    if isinstance(hull.geometry, Box):
        return (np.abs(local_m) - np.array(hull.geometry.size_xyz_m) / 2).max()
    if isinstance(hull.geometry, Sphere):
        return (np.linalg.norm(local_m, axis=1) - hull.geometry.radius_m).max()
    radial_m = np.hypot(local_m[:, 0], local_m[:, 1]) - hull.geometry.radius_m
    return max(radial_m.max(), (np.abs(local_m[:, 2]) - hull.geometry.length_m / 2).max())


def no_file(_uri):
    return None


def test_corners_in_the_link_are_scaled_then_turned_then_moved():
    shape = mesh_shape(listed_mesh('a.stl', np.array([[1.0, 0, 0]])), 2.0, (0, 0, 3), (0, 0, np.pi / 2))
    assert link_corners_m(shape, 'my.urdf', no_file) == pytest.approx(np.array([[0, 2, 3]]))


def test_a_box_that_is_modelled_along_its_own_axes_keeps_them(tmp_path):
    hull = hull_of(tmp_path, CUBE_CORNERS * [3, 1, 0.5], rpy_rad=(0, 0, 0.5))
    assert hull.geometry == Box((6, 2, 1))
    assert hull.pose_in_link == pytest.approx(pose(rpy_rad=(0, 0, 0.5)))


def test_listed_corners_keep_all_their_digits():
    corners_m = random_rotation(np.random.default_rng(11)) / 3
    uri = listed_mesh('package://p/meshes/a.stl', corners_m)
    assert is_listed(uri)
    assert (file_corners_m(uri, 'my.urdf', no_file) == corners_m).all()
