"""Nominal wheel diameter and separation: of the user, the robot's controller, or the shapes."""

from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.coaxial_pairs import WheelPair
from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.gazebo_tags import DriveTags
from diff_encoder_sim.robots.robot_choices import RobotChoices

AGREE = 0.005  # relative difference that is not worth a line
# A controller's number that differs by more is a mistake in it, such as a radius for a diameter; by less it is a wheel
# measured while it rolls under load.
MEASURED = 0.1
LARGEST_M = 2.0  # of a wheel on a robot that drives indoors


class WheelGeometry(NamedTuple):
    """What controller and odometry assume of both wheels, and what the physics builds."""

    diameter_m: float
    separation_m: float  # between the contact points


def wheel_geometry(
    where: str, pair: WheelPair, drives: Sequence[DriveTags], choices: RobotChoices, seen: Findings
) -> WheelGeometry:
    """Return the nominal geometry; where from, and who disagrees, is added to what is seen.

    Args:
        where: begins the error: the robot's file.
        pair: the driven wheels.
        drives: plugins and controllers that drive them.
        choices: the user's.
        seen: takes sources and disagreements.

    Raises:
        ConfigError: nothing gives the size of the wheels.
    """
    return WheelGeometry(
        _diameter_m(where, pair, drives, choices.wheel_diameter, seen),
        _separation_m(pair, drives, choices.wheel_separation, seen),
    )


def _diameter_m(
    where: str, pair: WheelPair, drives: Sequence[DriveTags], chosen_m: Optional[float], seen: Findings
) -> float:
    """Return the diameter: a controller's rather than the shape's, unless it is out of question."""
    given = _given([(tags.source, tags.diameter_m) for tags in drives])
    shape = _shape_diameter(pair, seen)
    value_m, source = shape or given or (None, '')
    if shape is not None and given is not None and _differ(shape[0], given[0]) > AGREE:
        is_measured = _differ(shape[0], given[0]) <= MEASURED
        value_m, source = given if is_measured else shape
        seen.warn(
            f'wheel diameter: {given[0]:.5g} m by {given[1]}, '
            f'{shape[0]:.5g} m by the {shape[1]}: {value_m:.5g} m is used'
        )
    elif given is not None:
        value_m, source = given
    if chosen_m is not None:
        value_m, source = chosen_m, 'given'
    if value_m is None:
        raise ConfigError(
            f'{where}: given wheels {pair.left.link!r} and {pair.right.link!r} without a round shape; '
            'allowed: a collision cylinder, sphere or round mesh on the axle, or simulator.wheel_diameter'
        )
    if value_m > LARGEST_M:
        seen.warn(f'wheels of {value_m:.5g} m: a URDF is in metres; are its lengths in mm?')
    seen.add('wheel diameter [m]', f'{value_m:.5g}', source)
    return value_m


def _shape_diameter(pair: WheelPair, seen: Findings) -> Optional[Tuple[float, str]]:
    """Return the mean diameter of the shapes, and which they are."""
    left_m, right_m = pair.left.radius_m, pair.right.radius_m
    if left_m is None or right_m is None:
        one_m = left_m or right_m
        return None if one_m is None else (2.0 * one_m, f'{(pair.left if left_m else pair.right).shape}')
    if _differ(left_m, right_m) > 1e-4:
        seen.warn(
            f'the wheels differ: diameters {2 * left_m:.5g} m (left) and {2 * right_m:.5g} m (right) by their shapes; '
            'both are simulated with the nominal one'
        )
    return left_m + right_m, pair.left.shape


def _separation_m(pair: WheelPair, drives: Sequence[DriveTags], chosen_m: Optional[float], seen: Findings) -> float:
    """Return the separation: the shapes', unless the user knows better."""
    value_m = float(pair.left.centre_m[1] - pair.right.centre_m[1])
    source = 'middles of the wheels' if pair.left.radius_m else 'joints of the wheels'
    given = _given([(tags.source, tags.separation_m) for tags in drives])
    if given is not None and _differ(value_m, given[0]) > AGREE:
        seen.warn(
            f'wheel separation: {given[0]:.5g} m by {given[1]}, {value_m:.5g} m between the {source}, which is used'
        )
    if chosen_m is not None:
        value_m, source = chosen_m, 'given'
    seen.add('wheel separation [m]', f'{value_m:.5g}', source)
    return value_m


def _given(given: Sequence[Tuple[str, Optional[float]]]) -> Optional[Tuple[float, str]]:
    return next(((value_m, source) for source, value_m in given if value_m is not None), None)


def _differ(a: float, b: float) -> float:
    """Return the relative difference."""
    return abs(a - b) / max(a, b)
