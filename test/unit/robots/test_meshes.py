"""Meshes: their corners in each format, primitives in their place, and meshes that are missing."""

import sys
from xml.etree import ElementTree

import collada
import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import Findings
from diff_encoder_sim.robots.meshes import file_corners_m, mesh_hull, primitive_tree
from diff_encoder_sim.robots.solids import Box, Cylinder, Mesh, Shape, Sphere, reach_m
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.trials.trial_files import self_contained_urdf
from robot_parts import CUBE_CORNERS, CUBE_TRIANGLES, finder, pose, random_rotation, shape, write_mesh
from urdf_texts import ball, base, described, found, joint, link, pair, robot, tree_of, usual

WHERE = "my.urdf: link 'base': collision mesh 'a.stl'"


def corners_of(folder, name):
    return file_corners_m(f'package://p/{name}', WHERE, finder(folder))


def extents_m(points_m):
    return np.array([points_m.min(axis=0), points_m.max(axis=0)])


def write_dae(path, corners):
    document = collada.Collada()
    info = document.assetInfo
    info.unitname, info.unitmeter, info.upaxis = 'unit', 1.0, 'Z_UP'
    points = collada.source.FloatSource('points', np.ravel(corners), ('X', 'Y', 'Z'))
    part = collada.geometry.Geometry(document, 'part', 'part', [points])
    inputs = collada.source.InputList()
    inputs.addInput(0, 'VERTEX', '#points')
    part.primitives.append(part.createTriangleSet(CUBE_TRIANGLES.ravel(), inputs, 'm'))
    document.geometries.append(part)
    shown = collada.scene.Node('n', children=[collada.scene.GeometryNode(part, [])])
    document.scene = collada.scene.Scene('scene', [shown])
    document.scenes.append(document.scene)
    document.write(str(path))


def write(path, corners=CUBE_CORNERS):
    if path.suffix == '.dae':
        write_dae(path, corners)
        return
    write_mesh(path, corners, CUBE_TRIANGLES, {'text.stl': 'stl_ascii', 'a.obj': 'obj'}.get(path.name, 'stl'))
    content = path.read_bytes()
    if path.name == 'solid.stl':
        path.write_bytes(b'solid though it is binary'.ljust(80) + content[80:])
    if path.suffix == '.obj':
        path.write_bytes(b'mtllib missing.mtl\nusemtl none\n' + content)


@pytest.mark.parametrize('name', ['text.stl', 'binary.stl', 'solid.stl', 'a.obj', 'a.dae', 'LOUD.STL'])
def test_every_format_gives_the_corners_and_a_cube_becomes_a_box(tmp_path, name):
    write(tmp_path / name, CUBE_CORNERS * [1, 2, 3] + [4, 5, 6])
    assert extents_m(corners_of(tmp_path, name)) == pytest.approx(np.array([[3, 3, 3], [5, 7, 9]]))
    mesh = f'<mesh filename="package://p/meshes/{name}" scale="0.1 0.1 0.1"/>'
    seen = Findings()
    tree = primitive_tree(tree_of(robot(link('base', mesh, 'xyz="1 2 3"'))), finder(tmp_path), seen)
    (box,) = tree.links['base'].collisions
    assert box.geometry == Box((0.2, 0.4, 0.6))
    assert box.pose_in_link == pytest.approx(pose((1.4, 2.5, 3.6)))
    assert seen.notes == [f'collision mesh {name} of link base is simulated as {box.geometry}']


@pytest.mark.parametrize(('name', 'begin'), [('text.stl', b'solid '), ('a.obj', b'# ')])
def test_names_in_a_mesh_may_be_in_any_encoding(tmp_path, monkeypatch, name, begin):
    """Also where what trimesh guesses encodings by is not installed."""
    for guesser in ('chardet', 'charset_normalizer'):
        monkeypatch.setitem(sys.modules, guesser, None)
    write(tmp_path / name)
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(begin + 'Gehäuse\n'.encode('latin-1') + content[5 if name == 'text.stl' else 0 :])
    assert extents_m(corners_of(tmp_path, name)) == pytest.approx(extents_m(CUBE_CORNERS))


@pytest.mark.parametrize('name', ['a.obj', 'a.dae'])
def test_a_corner_that_no_triangle_has_does_not_count_and_an_edited_mesh_is_read_again(tmp_path, name):
    write(tmp_path / name, np.vstack([CUBE_CORNERS, [9, 9, 9]]))
    assert corners_of(tmp_path, name).max() == 1
    write(tmp_path / name, 2 * CUBE_CORNERS)
    assert corners_of(tmp_path, name).max() == 2


MATERIAL = (
    'url="#part"><bind_material><technique_common><instance_material symbol="m" target="#m"/></technique_common>'
    '</bind_material></instance_geometry>'
)
TURNED = '<translate>10 0 0</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale><instance_geometry'


@pytest.mark.parametrize(
    ('old', 'new', 'expected_m'),
    [
        ('meter="1.0"', 'meter="0.1"', [[-0.1, -0.2, -0.3], [0.1, 0.2, 0.3]]),
        ('Z_UP', 'Y_UP', [[-1, -2, -3], [1, 2, 3]]),  # left as it is, as in RViz and Gazebo
        ('<instance_geometry', TURNED, [[8, -2, -3], [12, 2, 3]]),
        ('url="#part"/>', MATERIAL, [[-1, -2, -3], [1, 2, 3]]),  # the material is missing
    ],
)
def test_units_nodes_and_missing_materials_of_a_dae(tmp_path, old, new, expected_m):
    write(tmp_path / 'a.dae', CUBE_CORNERS * [1, 2, 3])
    text = (tmp_path / 'a.dae').read_text()
    assert old in text
    (tmp_path / 'a.dae').write_text(text.replace(old, new))
    assert extents_m(corners_of(tmp_path, 'a.dae')) == pytest.approx(np.array(expected_m), abs=1e-5)


BROKEN = {
    'empty.stl': b'',
    'words.dae': b'this is no mesh at all',
    'no_triangles.obj': b'v 0 0 0\nv 1 0 0\nv 0 1 0\n',
    'wrong_index.obj': b'v 0 0 0\nv 1 0 0\nf 1 2 7\n',
    'html.stl': b'<!DOCTYPE html><html>404: Not Found</html>' * 9,
    'a.step': b'ISO-10303-21;',
    'missing.stl': None,
}


@pytest.mark.parametrize('name', sorted(BROKEN))
def test_a_broken_or_missing_mesh_is_one_line_that_names_it(tmp_path, name, capfd):
    if BROKEN[name] is not None:
        (tmp_path / name).write_bytes(BROKEN[name])
    with pytest.raises(ConfigError, match=f'^{WHERE}: given [^\n]*; allowed: [^\n]*$'):
        corners_of(tmp_path, name)
    assert capfd.readouterr() == ('', '')


def hull_of(folder, points_m, scale=1.0, **placement):
    first = np.arange(len(points_m))
    triangles = np.stack([first, np.roll(first, 1), np.roll(first, 2)], axis=1)
    write_mesh(folder / 'a.obj', points_m, triangles, 'obj')
    return mesh_hull(shape(Mesh('package://p/a.obj', (scale,) * 3), **placement), 'my.urdf', finder(folder))


def disc(*radii_and_heights_m, count=24):
    bearings_rad = 2 * np.pi * np.arange(count) / count
    rim = np.column_stack([np.cos(bearings_rad), np.sin(bearings_rad)])
    return np.vstack([np.column_stack([r * rim, np.full(count, z)]) for r, z in radii_and_heights_m])


@pytest.mark.parametrize('axis', [0, 1, 2])
def test_a_wheel_becomes_a_cylinder_along_its_axis(tmp_path, axis):
    hull = hull_of(tmp_path, np.roll(disc((33, -9), (33, 9)), axis + 1, axis=1), scale=1e-3)
    assert hull.geometry == Cylinder(0.033, 0.018)
    assert np.abs(hull.pose_in_link[:3, 2]) == pytest.approx(np.eye(3)[axis])
    assert np.linalg.det(hull.pose_in_link[:3, :3]) == pytest.approx(1)


def test_a_ball_becomes_a_sphere(tmp_path):
    directions = np.random.default_rng(4).normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    hull = hull_of(tmp_path, 0.02 * np.vstack([directions, -directions]) + [1, 2, 3])
    assert isinstance(hull.geometry, Sphere)
    assert hull.geometry.radius_m == pytest.approx(0.02, abs=5e-6)
    assert hull.pose_in_link == pytest.approx(pose((1, 2, 3)))


def test_a_scale_that_mirrors_own_axes_and_a_flat_sheet(tmp_path):
    hull = hull_of(tmp_path, CUBE_CORNERS * [3, 1, 0.5], rpy_rad=(0, 0, 0.5))
    assert hull.geometry == Box((6, 2, 1))
    assert hull.pose_in_link == pytest.approx(pose(rpy_rad=(0, 0, 0.5)))
    assert hull_of(tmp_path, CUBE_CORNERS * [1, 1, 0]).geometry == Box((2, 2, 0.001))
    hull_of(tmp_path, CUBE_CORNERS + [1, 0, 0])
    hull = mesh_hull(Shape(Mesh('a.obj', (-1.0, 2.0, 3.0)), np.eye(4)), 'my.urdf', finder(tmp_path))
    assert hull.geometry == Box((2, 4, 6))
    assert hull.pose_in_link == pytest.approx(pose((-1, 0, 0)))
    with pytest.raises(ConfigError, match='^my.urdf: collision mesh .* given a mesh without extent; allowed: [^\n]*$'):
        hull_of(tmp_path, CUBE_CORNERS * (1, 0, 0))


def test_hulls_of_random_meshes_hold_every_corner(tmp_path):
    rng = np.random.default_rng(5)
    for _ in range(20):
        points_m = rng.normal(size=(12, 3)) * rng.uniform(0.01, 1, 3) @ random_rotation(rng).T
        hull = hull_of(tmp_path, points_m, xyz_m=rng.normal(size=3), rpy_rad=rng.normal(size=3))
        for direction in np.vstack([hull.pose_in_link[:3, :3].T, rng.normal(size=(20, 3))]):
            assert (hull.corners_m @ direction).max() < reach_m([hull], direction) * np.linalg.norm(direction) + 1e-5
        (tmp_path / 'a.obj').unlink()


@pytest.mark.parametrize('kind', ['collision', 'visual'])
def test_a_robot_whose_wheels_are_meshes_has_their_radius(tmp_path, kind):
    corners_m = disc((0.05, -0.01), (0.05, 0.01))
    triangles = np.array([[index, index + 1, index + 2] for index in range(len(corners_m) - 2)])
    write_mesh(tmp_path / 'wheel.stl', corners_m, triangles)
    wheels = ''.join(
        link(f'{side}_wheel', '<mesh filename="package://any/wheel.stl"/>', f'rpy="{roll} 0 0"', 0.1, kind)
        + joint(f'{side}_wheel_joint', f'{side}_wheel', f'0 {y_m} 0.05', 'continuous')
        for side, y_m, roll in (('left', 0.15, 1.5707963267948966), ('right', -0.15, -1.5707963267948966))
    )
    description = described(robot(base(), wheels, ball('ball', 0.1)), find=finder(tmp_path))
    assert found(description, 'wheel diameter [m]') == ('0.1', f'{kind} cylinder')
    assert description.wheel_separation_m == pytest.approx(0.3)


def housing(name, parent='base_link', mass_kg=0.1):
    mesh = link(name, '<mesh filename="package://sensors/housing.stl"/>', mass_kg=mass_kg)
    return mesh + joint(f'{name}_joint', name, '0 0 0.3', parent=parent)


def test_a_missing_or_broken_housing_of_a_sensor_is_left_out_with_a_warning_also_for_workers(tmp_path):
    text = usual(housing("lidar's housing"))
    description = described(text)
    (warning,) = [text for text in description.warnings if 'package://sensors/housing.stl' in text]
    assert "lidar's housing" in warning and 'missing' in warning
    assert description.footprint == described(usual()).footprint
    assert self_contained_urdf(text, 'made.urdf', lambda uri: None) == (text, {})
    # Other shapes of its link stay.
    (tmp_path / 'housing.stl').write_text('solid')
    sphere = '<collision><geometry><sphere radius="0.6"/></geometry></collision></link>'
    description = described(usual(housing('case').replace('</link>', sphere)), find=finder(tmp_path))
    assert [text for text in description.warnings if 'given no valid mesh' in text or 'triangles' in text]
    assert max(x_m for x_m, _ in description.footprint) > 0.55


@pytest.mark.parametrize(
    'parts',
    [
        (base(), pair(), housing('chassis', mass_kg=5.0)),
        (base(), pair(), housing('front_caster')),
        (base(), pair(), housing('tyre', parent='left_wheel')),
        (base(), pair(parent='deck'), housing('deck')),
        (base(body='').replace('<geometry></geometry>', ''), pair(), housing('case')),  # its only shape
    ],
)
def test_a_mesh_of_the_body_a_caster_or_a_wheel_must_be_there(parts):
    with pytest.raises(ConfigError, match=r"made.urdf: link '\w+': collision mesh 'package://sensors/housing.stl': "):
        described(robot(*parts))


MESH = '<{0}><geometry><mesh filename="package://p/{1}"/></geometry></{0}>'
URDF = robot(
    link('base', '<mesh filename="package://p/a.stl" scale="0.1 0.2 0.3"/>', inside=MESH.format('visual', 'seen.dae')),
    '<gazebo><plugin filename="libgazebo_ros_diff_drive.so"><gz:x>1</gz:x></plugin></gazebo>',
    joint('j', 'wheel', '0 0 0', 'continuous', 'base'),
    link('wheel', inside=''.join(MESH.format('visual', f'{name}.stl') for name in ('drum', 'missing'))),
).replace('name="made"', 'name="made" xmlns:gz="http://gazebosim.org"')
URDF = URDF.replace('<link name="wheel">', '<link name="wheel">' + MESH.format('collision', 'a.stl'))


def test_meshes_that_count_travel_with_the_robot_and_all_else_stays(tmp_path):
    """A wheel that is round to the eye only needs its visual mesh."""
    write_mesh(tmp_path / 'a.stl', CUBE_CORNERS, CUBE_TRIANGLES)
    drum = np.roll(disc((1, -1), (1, 1), count=12), 2, axis=1)
    write_mesh(tmp_path / 'drum.stl', drum, np.arange(24).reshape(-1, 3))
    urdf, files = self_contained_urdf(URDF, 'my.urdf', finder(tmp_path))
    names = [mesh.get('filename') for mesh in ElementTree.fromstring(urdf).iter('mesh')]
    assert [name.rsplit('/', 1)[-1] for name in names] == ['a.stl', 'seen.dae', 'a.stl', 'drum.stl', 'missing.stl']
    assert sorted(files) == sorted({name for name in names if ':' not in name}) and len(files) == 2
    assert '>1<' in urdf and 'scale="0.1 0.2 0.3"' in urdf
    for name, content in files.items():
        (tmp_path / 'sent' / name).parent.mkdir(parents=True)
        (tmp_path / 'sent' / name).write_bytes(content)
    before = primitive_tree(parse_urdf(URDF, 'my.urdf'), finder(tmp_path), right := Findings())
    after = primitive_tree(parse_urdf(urdf, 'my.urdf'), lambda uri: tmp_path / 'sent' / uri, found := Findings())
    assert found.notes == right.notes and right.notes
    assert str(after.links) == str(before.links)
    (round_one,) = after.links['wheel'].visuals
    assert isinstance(round_one.geometry, Cylinder)
