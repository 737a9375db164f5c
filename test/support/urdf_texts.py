"""URDF texts of small robots, put together from parts, and what is found out about them."""

import numpy as np

from diff_encoder_sim.robots.describing import describe_tree
from diff_encoder_sim.robots.description import Findings, RobotChoices
from diff_encoder_sim.robots.urdf_reading import parse_urdf

RADIUS_M = 0.05
SEPARATION_M = 0.3

LEVEL = 'xyz="0 0 0" rpy="1.5707963267948966 0 0"'  # a cylinder's axis along y


def link(name, geometry='', origin='xyz="0 0 0"', mass_kg=None, shape='collision', inside=''):
    body = f'<{shape}><origin {origin}/><geometry>{geometry}</geometry></{shape}>' if geometry else ''
    return f'<link name="{name}">{"" if mass_kg is None else inertial(mass_kg, 0.001 * mass_kg)}{body}{inside}</link>'


def inertial(mass_kg, moments_kgm2, at='0 0 0'):
    """An inertia by its three principal moments or the same one three times."""
    moments = zip(('ixx', 'iyy', 'izz'), np.broadcast_to(moments_kgm2, 3))
    inertia = ' '.join(f'{axis}="{moment}"' for axis, moment in moments) + ' ixy="0" ixz="0" iyz="0"'
    return f'<inertial><origin xyz="{at}"/><mass value="{mass_kg}"/><inertia {inertia}/></inertial>'


def joint(name, child, at, kind='fixed', parent='base_link', axis='0 1 0', inside='', rpy='0 0 0'):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}" rpy="{rpy}"/><axis xyz="{axis}"/>{inside}</joint>'
    )


def cylinder(radius_m, length_m=0.02):
    return f'<cylinder radius="{radius_m}" length="{length_m}"/>'


def sphere(radius_m):
    return f'<sphere radius="{radius_m}"/>'


def box(x_m, y_m, z_m):
    return f'<box size="{x_m} {y_m} {z_m}"/>'


def wheel(name, x_m=0.0, y_m=0.0, radius_m=RADIUS_M, axis='0 1 0', parent='base_link', z_m=None, origin=LEVEL, **given):
    """A cylinder wheel on the floor, below a base_link on the floor; its joint is NAME_joint."""
    at = f'{x_m} {y_m} {radius_m if z_m is None else z_m}'
    body = link(name, cylinder(radius_m), origin, 0.1)
    return body + joint(f'{name}_joint', name, at, **{'kind': 'continuous', **given}, parent=parent, axis=axis)


def pair(radius_m=RADIUS_M, separation_m=SEPARATION_M, x_m=0.0, names=('left_wheel', 'right_wheel'), **given):
    left, right = names
    half_m = 0.5 * separation_m
    return wheel(left, x_m, half_m, radius_m, **given) + wheel(right, x_m, -half_m, radius_m, **given)


def ball(name, x_m, clearance_m=0.0, radius_m=0.02, y_m=0.0):
    return link(name, sphere(radius_m)) + joint(f'{name}_joint', name, f'{x_m} {y_m} {radius_m + clearance_m}')


def base(mass_kg=2.0, com_x_m=0.02, body=box(0.3, 0.2, 0.1)):
    """base_link on the floor with a body 5 cm above it."""
    mass = inertial(mass_kg, 0.005 * mass_kg, f'{com_x_m} 0 0.1')
    shape = f'<collision><origin xyz="0 0 0.1"/><geometry>{body}</geometry></collision>'
    return f'<link name="base_link">{mass}{shape}</link>'


def robot(*parts):
    return f'<robot name="made">{"".join(parts)}</robot>'


def usual(*parts):
    """A robot with two wheels and a ball in front, and more."""
    return robot(base(), pair(), ball('ball_caster', 0.1), *parts)


def tree_of(text):
    return parse_urdf(text, 'made.urdf')


def described(text, find=lambda uri: None, **choices):
    return describe_tree(tree_of(text), find, RobotChoices(**choices), Findings())


def found(description, quantity):
    """Return value and source of a row of the table."""
    return next((row.value, row.source) for row in description.found if row.quantity == quantity)


def plugin(filename, **tags):
    inside = ''.join(f'<{name}>{value}</{name}>' for name, value in tags.items())
    return f'<gazebo><plugin name="any" filename="{filename}">{inside}</plugin></gazebo>'


def transmission(joint_name, interface='VelocityJointInterface'):
    interface = f'<hardwareInterface>hardware_interface/{interface}</hardwareInterface>'
    return f'<transmission><joint name="{joint_name}">{interface}</joint></transmission>'


def laser_sensor(
    link_name, frame='', kind='ray', samples=360, rate=10, ranges=(0.12, 3.5), angles=(0.0, 6.28), pose=''
):
    scan = f'<samples>{samples}</samples><resolution>1</resolution>'
    scan += f'<min_angle>{angles[0]}</min_angle><max_angle>{angles[1]}</max_angle>'
    limits = f'<range><min>{ranges[0]}</min><max>{ranges[1]}</max></range><noise><stddev>0.01</stddev></noise>'
    return (
        f'<gazebo reference="{link_name}"><sensor type="{kind}" name="any"><pose>{pose}</pose>'
        f'<update_rate>{rate}</update_rate><ray><scan><horizontal>{scan}</horizontal></scan>{limits}</ray>'
        f'<plugin name="scan" filename="liblaser.so"><frameName>{frame}</frameName></plugin></sensor></gazebo>'
    )
