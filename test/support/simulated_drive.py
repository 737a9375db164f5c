"""A drive with ramps, the geometry of ALTO, and worlds of boxes, for the tests of the simulator."""

import math

import numpy as np

RADIUS_M, SEPARATION_M = 0.1, 0.4


def drive(simulator, linear, angular, seconds):
    """Drive with ramps; returns wheel angles turned (2) and the true yaw turned [rad]."""
    before = np.array(simulator.joint_states().angles_rad)
    yaw, turned = simulator.physics.base_pose_in_plane().yaw_rad, 0.0
    for tick in range(round(seconds * 100) + 100):
        if tick % 5 == 0:
            ramp = min(1.0, (tick + 5) / 60)
            stopping = tick >= seconds * 100
            simulator.command(0.0 if stopping else ramp * linear, 0.0 if stopping else ramp * angular)
        simulator.tick()
        now = simulator.physics.base_pose_in_plane().yaw_rad
        turned += (now - yaw + math.pi) % (2 * math.pi) - math.pi
        yaw = now
    return np.array(simulator.joint_states().angles_rad) - before, turned


def box_world(path, *boxes):
    """A floor, and boxes given by their poses and sizes."""
    shapes = {'0 0 0': '<plane/>', **{pose: f'<box><size>{size}</size></box>' for pose, size in boxes}}
    models = ''.join(
        f'<model name="at {pose}"><static>1</static><pose>{pose} 0 0 0</pose><link name="l"><collision name="c">'
        f'<geometry>{shape}</geometry></collision></link></model>'
        for pose, shape in shapes.items()
    )
    path.write_text(f'<sdf version="1.6"><world name="w">{models}</world></sdf>')
    return path
