"""URDFs as people write them: cylinder wheels, swivel casters, links without inertia, meshes, mirrored axes."""

import math
from typing import NamedTuple, Tuple

import numpy as np

from robot_parts import write_mesh
from urdf_texts import box, cylinder, inertial, joint, link, robot, sphere

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
    frames = (link(f'frame_{n}') + _mount(f'frame_{n}', (0.01, 0.0, 0.1)) for n in range(recipe.frames))
    x_m, y_m, z_m = recipe.laser_m
    return robot(
        _root(recipe),
        *(_wheel(recipe, joint_name, side, folder) for joint_name, side in ((LEFT, 1.0), (RIGHT, -1.0))),
        *(_caster(recipe, index, place_m) for index, place_m in enumerate(recipe.casters_m)),
        *frames,
        link(LASER) + _mount(LASER, (x_m, y_m, z_m - recipe.root_height_m)),
    )


def _root(recipe: Recipe) -> str:
    (x_m, y_m, z_m), height_m = recipe.com_m, recipe.body_m[2]
    mass_kg = recipe.mass_kg - 2 * recipe.wheel_mass_kg * recipe.has_inertia
    moments = [mass_kg / 12 * (recipe.body_m[a] ** 2 + recipe.body_m[b] ** 2) for a, b in ((1, 2), (0, 2), (0, 1))]
    middle = f'xyz="{recipe.body_x_m} 0 {0.02 + 0.5 * height_m - recipe.root_height_m}"'
    mass = inertial(mass_kg, moments, f'{x_m} {y_m} {z_m - recipe.root_height_m}')
    return link('base', box(*recipe.body_m), middle, inside=mass)


def _wheel(recipe: Recipe, name: str, side: float, folder) -> str:
    """A wheel whose link's z axis is its axle, as the TurtleBot3's."""
    child, radius_m, mass_kg = name.replace('joint', 'link'), recipe.radius_m, recipe.wheel_mass_kg
    shape, inside = cylinder(radius_m, 0.018), ''
    if recipe.wheel == 'cylinders':
        inside = f'<collision><geometry>{cylinder(0.4 * radius_m, 0.03)}</geometry></collision>'
    if recipe.wheel == 'mesh':
        shape = '<mesh filename="wheel.stl" scale="0.001 0.001 0.001"/>'
        write_cylinder_stl(folder / 'wheel.stl', 1000 * radius_m, 18.0)
    if recipe.has_inertia:
        inside += inertial(mass_kg, np.array([0.25, 0.25, 0.5]) * mass_kg * radius_m**2)
    place = f'{recipe.axle_x_m} {0.5 * side * recipe.separation_m} {radius_m - recipe.root_height_m}'
    roll_rad = math.copysign(math.pi / 2, 1 if recipe.has_mirrored_axes and side < 0 else -1)
    axle = joint(name, child, place, 'continuous', 'base', '0 0 1', rpy=f'{roll_rad} 0 0')
    return link(child, shape, inside=inside) + axle


def _caster(recipe: Recipe, index: int, place_m: Tuple[float, float]) -> str:
    name, fork, (x_m, y_m), down_m = f'caster_{index}', f'fork_{index}', place_m, -recipe.root_height_m
    mass = inertial(0.005, 1e-6) if recipe.has_inertia else ''
    if recipe.caster == 'swivel':
        wheel_m = 0.3 * recipe.radius_m
        swivel = link(fork, inside=mass) + _mount(fork, (x_m, y_m, 2 * wheel_m + down_m), 'base', 'continuous', '0 0 1')
        rolling = link(name, cylinder(wheel_m, 0.01), f'rpy="{math.pi / 2} 0 0"', inside=mass)
        return swivel + rolling + _mount(name, (-0.01, 0, -wheel_m), fork, 'continuous', '0 1 0')
    size_m = 0.2 * recipe.radius_m
    shape = sphere(size_m) if recipe.caster == 'ball' else box(size_m, size_m, 2 * size_m)
    return link(name, shape, inside=mass) + _mount(name, (x_m, y_m, size_m + down_m))


def _mount(child: str, xyz_m: Vector, parent: str = 'base', kind: str = 'fixed', axis: str = '1 0 0') -> str:
    return joint(f'{child}_mount', child, ' '.join(map(str, xyz_m)), kind, parent, axis)


def write_cylinder_stl(path, radius_mm: float, length_mm: float, sides: int = 64) -> None:
    """Write a binary STL of a cylinder along z, without its faces."""
    angles = np.linspace(0.0, 2 * math.pi, sides, endpoint=False)
    rim = np.stack([radius_mm * np.cos(angles), radius_mm * np.sin(angles)], axis=1)
    corners = np.vstack([np.column_stack([rim, np.full(sides, z)]) for z in (-0.5 * length_mm, 0.5 * length_mm)])
    here, after = np.arange(sides), np.roll(np.arange(sides), -1)
    triangles = np.vstack([np.stack([here, after, here + sides], 1), np.stack([after, after + sides, here + sides], 1)])
    write_mesh(path, corners, triangles)


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
