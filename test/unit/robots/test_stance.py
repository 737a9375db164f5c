"""How the robot of the file would stand."""

import math

import numpy as np
import pytest

from diff_encoder_sim.robots.contacts import WheelBase, tip_deg
from urdf_texts import ball, base, described, pair, robot

WHEELS = WheelBase(0.0, 0.0, 0.05, ())


def warnings_of(*parts, com_x_m=0.02):
    """The warnings, without that of the missing laser."""
    return described(robot(base(com_x_m=com_x_m), pair(), *parts)).warnings[:-1]


def test_a_robot_on_a_caster_below_its_centre_of_mass_stands_well():
    assert warnings_of(ball('front', 0.1)) == ()
    assert warnings_of(ball('front', 0.1), ball('rear', -0.1, clearance_m=0.002)) == ()
    assert warnings_of(ball('rear', -0.1), com_x_m=-0.02) == ()


def test_a_caster_on_the_other_side_does_not_hold_it():
    (warning,) = warnings_of(ball('rear', -0.1))
    assert warning == (
        'its centre of mass is ahead of the axle, where nothing touches the floor: it would tip by 19 degrees onto '
        'base_link; simulated level'
    )


def test_a_caster_high_above_the_floor_lets_it_tip():
    (warning,) = warnings_of(ball('front_caster', 0.1, clearance_m=0.01))
    assert 'it would tip by 5.9 degrees until front_caster carries it' in warning


def test_casters_on_both_sides_that_reach_below_the_wheels_lift_them():
    (warning,) = warnings_of(ball('front', 0.1, clearance_m=-0.004), ball('rear', -0.3, clearance_m=-0.008))
    assert warning.startswith('front and rear would lift the drive wheels by 5.0 mm')


def test_a_robot_without_a_caster_is_told_to_get_supports():
    (warning,) = warnings_of()
    assert warning.startswith('nothing but the drive wheels touches the floor (a balancing robot?)')


@pytest.mark.parametrize('angle_deg', [-3.0, 0.0, 10.0, 80.0])
def test_a_point_on_the_floor_that_is_turned_up_about_the_axle_tips_back_by_as_much(angle_deg):
    angle_rad = math.radians(angle_deg)
    x_m, below_m = 0.1, 0.05  # of the axle
    turned_x_m = x_m * math.cos(angle_rad) + below_m * math.sin(angle_rad)
    turned_z_m = x_m * math.sin(angle_rad) - below_m * math.cos(angle_rad)
    for side in (1, -1):
        assert tip_deg(np.array([side * turned_x_m, 0.0, 0.05 + turned_z_m]), WHEELS) == pytest.approx(angle_deg)


def test_a_point_nearer_to_the_axle_than_the_wheels_radius_never_touches():
    assert tip_deg(np.array([0.03, 0.0, 0.04]), WHEELS) is None
