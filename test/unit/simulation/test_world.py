"""World files: what is read, what is refused, and the shape of the two that we ship."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.solids import Shape
from diff_encoder_sim.simulation.world import Box, Cylinder, Plane, Sphere, load_world
from places import WORLDS

FLOOR = """<model name="floor"><static>true</static><link name="l"><collision name="c">
  <geometry><plane><normal>0 0 1</normal></plane></geometry></collision></link></model>"""


def world_of(body):
    return f'<sdf version="1.6"><world name="w">{body}</world></sdf>'


def loaded(folder, body):
    (folder / 'test.world').write_text(world_of(body))
    return load_world(folder / 'test.world')


def model(geometry, pose='', static='true'):
    return f"""<model name="m"><static>{static}</static>{pose}<link name="l"><collision name="c">
      <geometry>{geometry}</geometry></collision></link></model>"""


def is_occupied(world, x_m, y_m):
    """Whether a point 1 m above the floor is inside a box or a pillar."""
    shapes = [Shape(solid.shape, solid.pose_in_world) for solid in world.solids if solid.shape != Plane()]
    return any(shape.holds(np.array([x_m, y_m, 1.0])) for shape in shapes)


def test_poses_of_model_link_and_collision_are_chained(tmp_path):
    body = (
        FLOOR
        + """<model name="m"><static>1</static><pose>1 2 0 0 0 1.5707963267948966</pose>
      <link name="l"><pose>1 0 0 0 0 0</pose><collision name="c"><pose>0 1 0 0 0 0</pose>
      <geometry><box><size>1 2 3</size></box></geometry></collision></link></model>"""
    )
    box = loaded(tmp_path, body).solids[1]
    assert box.name == 'm/l/c'
    assert box.shape == Box((1, 2, 3))
    assert box.pose_in_world[:3, 3] == pytest.approx([0, 3, 0])  # (1,2) + turned (1,1)


def test_all_primitives_are_read(tmp_path):
    shapes = ('<sphere><radius>0.5</radius></sphere>', '<cylinder><radius>0.2</radius><length>2</length></cylinder>')
    world = loaded(tmp_path, FLOOR + ''.join(model(shape) for shape in shapes))
    assert [solid.shape for solid in world.solids] == [Plane(), Sphere(0.5), Cylinder(0.2, 2.0)]
    assert [model.name for model in world.models] == ['floor', 'm', 'm']


@pytest.mark.parametrize(
    ('content', 'complaint'),
    [
        (world_of(''), 'no floor'),
        (world_of(FLOOR + '<include><uri>model://sun</uri></include>'), '<include>'),
        (world_of(FLOOR + model('<mesh><uri>a.dae</uri></mesh>')), 'm/l/c: geometry mesh.*allowed: box'),
        (world_of(FLOOR + model('<box><size>1 2</size></box>')), "box size: given '1 2'; allowed: 3"),
        (world_of(FLOOR + model('<box><size>1 1 1</size></box>', '<pose>0 0 x 0 0 0</pose>')), 'pose'),
        (world_of(FLOOR + model('<box><size>1 1 1</size></box>', static='false')), "'m' moves"),
        ('', 'not valid XML'),
        ('<sdf><world>', 'not valid XML'),
        ('<robot name="x"/>', 'given <robot>'),
        ('<sdf/>', 'given <sdf>'),
        (None, 'cannot be read'),
    ],
)
def test_what_is_no_world_or_cannot_be_simulated_is_refused_by_name(tmp_path, content, complaint):
    path = tmp_path / 'test.world'
    if content is not None:
        path.write_text(content)
    with pytest.raises(ConfigError, match=f'^{path}: [^\n]*{complaint}[^\n]*$'):
        load_world(path)


def test_the_hallway_is_32_by_6_metres_and_free_along_its_axis():
    world = load_world(WORLDS / 'hallway.world')
    for x_m in np.arange(-15.9, 15.95, 0.2):
        for y_m in (-2.4, -1.2, 0.0, 1.2, 2.4):
            assert not is_occupied(world, x_m, y_m), (x_m, y_m)
    assert all(is_occupied(world, x_m, 0.0) for x_m in (-16.05, 16.05))
    wall_faces = [sum(is_occupied(world, x_m, side * 3.05) for x_m in np.arange(-15.9, 15.9, 0.1)) for side in (-1, 1)]
    assert all(0.6 * 318 < count < 318 for count in wall_faces)  # walls, with alcoves in them


def test_the_ros_logo_is_the_scaled_turtlebot_world():
    world = load_world(WORLDS / 'ros_logo.world')
    pillars = [solid for solid in world.solids if isinstance(solid.shape, Cylinder)]
    assert sorted(tuple(np.round(pillar.pose_in_world[:2, 3], 6)) for pillar in pillars) == sorted(
        (round(1.87 * i, 6), round(1.87 * j, 6)) for i in (-1, 0, 1) for j in (-1, 0, 1)
    )
    assert {round(pillar.shape.radius_m, 6) for pillar in pillars} == {0.255}
    inner_apothem_m = 2.933 * 1.7 * math.sqrt(0.75)
    for angle in np.radians([30, 90, 150, 210, 270, 330]):  # towards the middles of the sides
        x_m, y_m = math.cos(angle), math.sin(angle)
        assert is_occupied(world, (inner_apothem_m + 0.02) * x_m, (inner_apothem_m + 0.02) * y_m)
    assert is_occupied(world, 3.5 * 1.7, 0.0)  # head
    assert is_occupied(world, -1.8 * 1.7, 2.7 * 1.7)  # a hand
