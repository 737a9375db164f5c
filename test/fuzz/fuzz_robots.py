"""Robots: odd URDF, xacro and robot files, found out about, and simulated for a moment."""

import numpy as np
import yaml

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.trials.robot_params import load_robot, load_robot_config, override
from generated_robots import RECIPES, urdf_of
from odd_values import ODD_VALUES, damaged, odd_mapping, odd_xml, pick, write_yaml
from places import ROOT
from urdf_texts import laser_sensor, plugin, usual

TICKS = 3
WORLD = ROOT / 'worlds' / 'ros_logo.world'
XACROS = ('alto', 'burger', 'create2', 'kobuki')


def warm_up(folder):
    (folder / 'robot.urdf').write_text(urdf_of(RECIPES['ball caster'], folder))
    _use(folder / 'robot.urdf')


def run(rng, folder):
    make_and_use = pick(rng, (_odd_urdf, _odd_urdf, _odd_urdf, _odd_xacro, _odd_robot_file))
    make_and_use(rng, folder)


def _odd_urdf(rng, folder):
    recipe = pick(rng, [*RECIPES.values(), None])
    text = _with_gazebo_tags() if recipe is None else urdf_of(recipe, folder)
    (folder / 'robot.urdf').write_bytes(odd_xml(rng, text))
    mesh = folder / 'wheel.stl'
    if mesh.is_file() and rng.random() < 0.5:
        mesh.write_bytes(damaged(rng, mesh.read_bytes()))
    _use(folder / 'robot.urdf')


def _with_gazebo_tags():
    drive = plugin('libgazebo_ros_diff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint',
                   wheelSeparation=0.3, wheelDiameter=0.1)  # fmt: skip
    return usual('<link name="laser"/>', '<joint name="l" type="fixed"><parent link="base_link"/><child link="laser"/>'
                 '<origin xyz="0 0 0.3"/></joint>', laser_sensor('laser'), drive)  # fmt: skip


def _odd_xacro(rng, folder):
    """A xacro takes an interpreter of its own, so there are fewer of them."""
    text = (ROOT / 'urdf' / f'{pick(rng, XACROS)}.urdf.xacro').read_bytes()
    (folder / 'robot_parts.xacro').write_bytes((ROOT / 'urdf' / 'robot_parts.xacro').read_bytes())
    odd = damaged(rng, text) if rng.random() < 0.5 else odd_xml(rng, text.decode())
    (folder / 'robot.urdf.xacro').write_bytes(odd)
    _use(folder / 'robot.urdf.xacro', xacro_arguments(pick(rng, ([], ['a:=1'], ['radius:=1e400']))))


def _odd_robot_file(rng, folder):
    (folder / 'robot.urdf').write_text(urdf_of(RECIPES['ball caster'], folder))
    good = yaml.safe_load((ROOT / 'config' / 'robots' / 'burger.yaml').read_text())
    good.update(urdf='robot.urdf')
    odd = odd_mapping(rng, good)
    if rng.random() < 0.5:
        odd['set'] = {pick(rng, sorted(good.get('set') or ['config.rate'])): pick(rng, ODD_VALUES)}
    _use(write_yaml(rng, folder / 'robot.yaml', odd))


def _use(path, arguments=None):
    setup = load_robot(str(path), path.parent, ROOT, arguments or {})
    setup.check_laser()
    params = override(load_robot_config(ROOT / 'config'), setup.settings)
    simulator = Simulator(WORLD, setup.file.source, params.simulator, IDENTITY, seed=1)
    for _ in range(TICKS):
        simulator.command(0.1, 0.1)
        simulator.tick()
    assert np.isfinite(simulator.physics.base_pose_in_plane()).all(), 'the pose is not finite'
    simulator.scan()
    simulator.close()
