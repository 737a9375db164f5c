"""URDFs as people write them: cylinder wheels, swivel casters, links without inertia, meshes, mirrored axes."""

import math
from typing import NamedTuple, Tuple

import numpy as np

from robot_parts import write_binary_stl

Vector = Tuple[float, float, float]
LEFT, RIGHT, LASER = 'wheel_left_joint', 'wheel_right_joint', 'base_scan'


class Recipe(NamedTuple):
    """A robot; lengths in m, places in the root link."""

    mass_kg: float = 1.0
    com_m: Vector = (-0.02, 0.0, 0.04)  # of all but the wheels, above the floor
    body_m: Vector = (0.14, 0.14, 0.14)  # a box
    body_x_m: float = -0.03
    radius_m: float = 0.033
    separation_m: float = 0.16
    wheel: str = 'cylinder'  # 'mesh', 'cylinders' (tyre and hub)
    wheel_mass_kg: float = 0.03
    casters_m: Tuple[Tuple[float, float], ...] = ((-0.08, 0.0),)  # places
    caster: str = 'ball'  # 'swivel', 'box'
    axle_x_m: float = 0.0
    root_height_m: float = 0.0  # above the floor
    frames: int = 0  # links without inertia
    laser_m: Vector = (-0.03, 0.0, 0.18)
    has_mirrored_axes: bool = False  # both wheels' axes point outward
    has_inertia: bool = True  # else no link but the body has any


def urdf_of(recipe: Recipe, folder) -> str:
    """The URDF; meshes are written to `folder`."""
    parts = ['<robot name="generated">', _root(recipe)]
    for joint, side in ((LEFT, 1.0), (RIGHT, -1.0)):
        parts.append(_wheel(recipe, joint, side, folder))
    for index, place_m in enumerate(recipe.casters_m):
        parts.append(_caster(recipe, index, place_m))
    for index in range(recipe.frames):
        parts.append(f'<link name="frame_{index}"/>{_joint(f"frame_{index}", "base", (0.01, 0, 0.1))}')
    x_m, y_m, z_m = recipe.laser_m
    parts.append(f'<link name="{LASER}"/>{_joint(LASER, "base", (x_m, y_m, z_m - recipe.root_height_m))}')
    return '\n'.join([*parts, '</robot>'])


def _root(recipe: Recipe) -> str:
    (x_m, y_m, z_m), (length_m, width_m, height_m) = recipe.com_m, recipe.body_m
    mass_kg = recipe.mass_kg - 2 * recipe.wheel_mass_kg * recipe.has_inertia
    inertia = [mass_kg / 12 * (recipe.body_m[a] ** 2 + recipe.body_m[b] ** 2) for a, b in ((1, 2), (0, 2), (0, 1))]
    middle_m = 0.02 + 0.5 * height_m - recipe.root_height_m
    return f"""<link name="base">{_inertial(mass_kg, inertia, (x_m, y_m, z_m - recipe.root_height_m))}
      <collision><origin xyz="{recipe.body_x_m} 0 {middle_m}"/>
      <geometry><box size="{length_m} {width_m} {height_m}"/></geometry></collision></link>"""


def _wheel(recipe: Recipe, joint: str, side: float, folder) -> str:
    """A wheel whose link's z axis is its axle, as the TurtleBot3's."""
    link, radius_m, mass_kg = joint.replace('joint', 'link'), recipe.radius_m, recipe.wheel_mass_kg
    inertia = [0.25 * mass_kg * radius_m**2] * 2 + [0.5 * mass_kg * radius_m**2]
    shapes = [f'<cylinder radius="{radius_m}" length="0.018"/>']
    if recipe.wheel == 'cylinders':
        shapes.append(f'<cylinder radius="{0.4 * radius_m}" length="0.03"/>')
    if recipe.wheel == 'mesh':
        shapes = ['<mesh filename="wheel.stl" scale="0.001 0.001 0.001"/>']
        write_cylinder_stl(folder / 'wheel.stl', 1000 * radius_m, 18.0)
    collisions = ''.join(f'<collision><geometry>{shape}</geometry></collision>' for shape in shapes)
    place_m = recipe.axle_x_m, 0.5 * side * recipe.separation_m, radius_m - recipe.root_height_m
    roll_rad = math.copysign(math.pi / 2, 1 if recipe.has_mirrored_axes and side < 0 else -1)
    return f"""<link name="{link}">{_inertial(mass_kg, inertia) if recipe.has_inertia else ''}{collisions}</link>
      <joint name="{joint}" type="continuous"><parent link="base"/><child link="{link}"/>
      <origin xyz="{' '.join(map(str, place_m))}" rpy="{roll_rad} 0 0"/><axis xyz="0 0 1"/></joint>"""


def _caster(recipe: Recipe, index: int, place_m: Tuple[float, float]) -> str:
    x_m, y_m = place_m
    down_m = -recipe.root_height_m
    inertial = _inertial(0.005, [1e-6] * 3) if recipe.has_inertia else ''
    if recipe.caster == 'swivel':
        wheel_m = 0.3 * recipe.radius_m
        return f"""<link name="fork_{index}">{inertial}</link>
          {_joint(f'fork_{index}', 'base', (x_m, y_m, 2 * wheel_m + down_m), 'continuous', '0 0 1')}
          <link name="caster_{index}">{inertial}<collision><origin rpy="{math.pi / 2} 0 0"/><geometry>
          <cylinder radius="{wheel_m}" length="0.01"/></geometry></collision></link>
          {_joint(f'caster_{index}', f'fork_{index}', (-0.01, 0, -wheel_m), 'continuous', '0 1 0')}"""
    size_m = 0.2 * recipe.radius_m
    box = f'<box size="{size_m} {size_m} {2 * size_m}"/>'
    shape = f'<sphere radius="{size_m}"/>' if recipe.caster == 'ball' else box
    return f"""<link name="caster_{index}">{inertial}<collision><geometry>{shape}</geometry></collision></link>
      {_joint(f'caster_{index}', 'base', (x_m, y_m, size_m + down_m))}"""


def _joint(child: str, parent: str, xyz_m: Vector, kind: str = 'fixed', axis: str = '1 0 0') -> str:
    return f"""<joint name="{child}_mount" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
      <origin xyz="{' '.join(map(str, xyz_m))}"/><axis xyz="{axis}"/></joint>"""


def _inertial(mass_kg: float, moments: list, com_m: Vector = (0.0, 0.0, 0.0)) -> str:
    xx, yy, zz = moments
    return f"""<inertial><origin xyz="{' '.join(map(str, com_m))}"/><mass value="{mass_kg}"/>
      <inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>"""


def write_cylinder_stl(path, radius_mm: float, length_mm: float, sides: int = 64) -> None:
    """Write a binary STL of a cylinder along z, without its faces."""
    angles = np.linspace(0.0, 2 * math.pi, sides, endpoint=False)
    rim = np.stack([radius_mm * np.cos(angles), radius_mm * np.sin(angles)], axis=1)
    corners = np.vstack([np.column_stack([rim, np.full(sides, z)]) for z in (-0.5 * length_mm, 0.5 * length_mm)])
    here, after = np.arange(sides), np.roll(np.arange(sides), -1)
    triangles = np.vstack([np.stack([here, after, here + sides], 1), np.stack([after, after + sides, here + sides], 1)])
    write_binary_stl(path, corners, triangles)


RECIPES = {
    'ball caster': Recipe(),
    'frames without inertia': Recipe(frames=4, has_inertia=False),
    'two swivel casters in front': Recipe(
        20.0, (0.06, 0.0, 0.2), (0.5, 0.4, 0.3), 0.05, 0.08, 0.36, wheel_mass_kg=1.0,
        casters_m=((0.25, 0.12), (0.25, -0.12)), caster='swivel', laser_m=(0.2, 0.0, 0.4),
    ),
    'four swivel casters': Recipe(
        60.0, (0.01, 0.0, 0.15), (0.8, 0.5, 0.3), 0.0, 0.1, 0.44, wheel_mass_kg=2.0,
        casters_m=((0.35, 0.2), (0.35, -0.2), (-0.35, 0.2), (-0.35, -0.2)), caster='swivel', laser_m=(0.3, 0.0, 0.4),
    ),
    'front and rear ball': Recipe(
        2.4, (0.0, 0.0, 0.05), (0.3, 0.3, 0.06), 0.0, 0.035, 0.23, casters_m=((0.12, 0.0), (-0.12, 0.0)),
        laser_m=(0.0, 0.0, 0.12),
    ),
    'mesh wheels, root on the axle': Recipe(wheel='mesh', root_height_m=0.033),
    'laser aside, axle ahead of the root': Recipe(
        12.0, (0.05, 0.01, 0.15), (0.5, 0.35, 0.25), 0.0, 0.075, 0.33, axle_x_m=0.15, wheel_mass_kg=0.8,
        casters_m=((-0.2, 0.0),), laser_m=(0.21, -0.13, 0.32),
    ),
    'mirrored axes, tyre and hub': Recipe(wheel='cylinders', has_mirrored_axes=True, caster='box'),
}  # fmt: skip
