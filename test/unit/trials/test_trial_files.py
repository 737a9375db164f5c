"""The files that trials read, sent by content and written down where they run."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from campaign_files import ROOT, package_copy
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.trials.trial_files import collect

ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'
HORN = """<link name="horn"><collision><geometry><mesh filename="horn.stl"/></geometry></collision></link>
<joint name="horn_joint" type="fixed"><parent link="base_link"/><child link="horn"/><origin xyz="0.4 0 0.5"/></joint>"""
CORNERS = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])


def collected(package=ROOT, robot=None, needs_maps=True):
    tests = [load_test(name, package / 'config') for name in ('SL', 'SMT', 'DLD')]
    return collect(tests, package / 'worlds', robot or RobotSource(package / 'urdf' / 'alto.urdf.xacro'), needs_maps)


def test_what_is_written_is_what_was_read(tmp_path):
    placed = pickle.loads(pickle.dumps(collected())).materialise(tmp_path)
    assert placed.robot.read_bytes() == ROBOT.read_bytes()
    for test, stem in (('SL', 'hallway'), ('SMT', 'ros_logo'), ('DLD', 'ros_logo')):
        files = placed.worlds[test]
        assert Path(files['world']).read_bytes() == (ROOT / 'worlds' / f'{stem}.world').read_bytes()
        there, here = load_map(files['map']), load_map(ROOT / 'worlds' / f'{stem}.yaml')
        assert (there.cells == here.cells).all() and there.origin == here.origin
    assert placed.worlds['SMT'] == placed.worlds['DLD']


def test_half_a_folder_of_a_killed_writer_is_never_used_and_other_content_goes_to_another(tmp_path, monkeypatch):
    package = package_copy(tmp_path / 'package')
    files = collected(package)
    with monkeypatch.context() as patched:
        patched.setattr(os, 'replace', lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            files.materialise(tmp_path / 'out')
    before = files.materialise(tmp_path / 'out')
    (package / 'urdf' / 'alto.urdf.xacro').write_bytes(ROBOT.read_bytes() + b'\n')
    after = collected(package).materialise(tmp_path / 'out')
    assert before.robot.read_bytes() + b'\n' == after.robot.read_bytes() == ROBOT.read_bytes() + b'\n'


def test_a_maps_image_may_lie_elsewhere(tmp_path):
    package = package_copy(tmp_path / 'package')
    path = package / 'worlds' / 'hallway.yaml'
    image = tmp_path / 'pictures' / 'hallway.yaml'  # of a name that the map's own file has
    image.parent.mkdir()
    (package / 'worlds' / 'hallway.pgm').rename(image)
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), 'image': str(image)}))
    placed = collected(package).materialise(tmp_path / 'out')
    image.unlink()
    assert (load_map(placed.worlds['SL']['map']).cells == load_map(ROOT / 'worlds' / 'hallway.yaml').cells).all()


def test_a_map_is_only_needed_to_navigate(tmp_path):
    package = package_copy(tmp_path / 'package')
    (package / 'worlds' / 'hallway.yaml').unlink()
    with pytest.raises(ConfigError, match='map: .*hallway.yaml not found; allowed: .*rasterise_world'):
        collected(package)
    placed = collected(package, needs_maps=False).materialise(tmp_path / 'out')
    assert placed.worlds['SL']['map'] == '' and placed.worlds['SMT']['map'] != ''


@pytest.mark.parametrize(
    ('name', 'content', 'expected'),
    [
        ('worlds/hallway.world', '<sdf', 'not valid XML'),
        ('worlds/hallway.pgm', 'P5 1', 'hallway.pgm: '),
        ('worlds/hallway.yaml', 'image: none.pgm', 'hallway.yaml: '),
    ],
)
def test_a_bad_file_is_named_before_anything_runs(tmp_path, name, content, expected):
    package = package_copy(tmp_path / 'package')
    (package / name).write_text(content)
    with pytest.raises(ConfigError, match=expected):
        collected(package)


def test_a_robot_of_several_files_and_arguments_travels_as_one(tmp_path):
    """Burger's xacro includes another file; its workers need none."""
    source = RobotSource(ROOT / 'urdf' / 'burger.urdf.xacro')
    placed = collected(robot=source).materialise(tmp_path)
    text = placed.robot.read_text()
    assert placed.robot.name == 'burger.urdf' and 'xacro:' not in text
    there, here = describe(RobotSource(placed.robot)), describe(source)
    assert there.found == here.found and there.footprint == here.footprint
    with_argument = source._replace(file=ROBOT, arguments=(('lidar_noise', '0.25'),))
    assert '0.25' in collected(robot=with_argument).materialise(tmp_path).robot.read_text()


def test_a_collision_mesh_travels_with_the_robot(tmp_path):
    robot = ROBOT.read_text().replace('</robot>', f'{HORN}</robot>')
    (tmp_path / 'robot.urdf.xacro').write_text(robot)
    trimesh.Trimesh(CORNERS, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).export(tmp_path / 'horn.stl')
    source = RobotSource(tmp_path / 'robot.urdf.xacro')
    placed, here = collected(robot=source).materialise(tmp_path / 'out'), describe(source)
    (tmp_path / 'horn.stl').unlink()
    assert describe(RobotSource(placed.robot)).footprint == here.footprint
