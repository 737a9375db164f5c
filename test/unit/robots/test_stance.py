"""How the robot of the file would stand."""

from urdf_texts import ball, base, described, pair, robot


def warnings_of(*parts, com_x_m=0.02):
    """The warnings, without that of the missing laser."""
    return described(robot(base(com_x_m=com_x_m), pair(), *parts)).warnings[:-1]


def test_a_robot_on_a_caster_below_its_centre_of_mass_stands_well():
    assert warnings_of(ball('front', 0.1)) == ()
    assert warnings_of(ball('front', 0.1), ball('rear', -0.1, clearance_m=0.002)) == ()
    assert warnings_of(ball('rear', -0.1), com_x_m=-0.02) == ()


def test_a_caster_on_the_other_side_does_not_hold_it():
    (warning,) = warnings_of(ball('rear', -0.1))
    assert 'nothing touches the floor' in warning


def test_a_caster_high_above_the_floor_lets_it_tip():
    (warning,) = warnings_of(ball('front_caster', 0.1, clearance_m=0.01))
    assert 'it would tip until a contact 10 mm up carries it' in warning


def test_casters_on_both_sides_that_reach_below_the_wheels_lift_them():
    (warning,) = warnings_of(ball('front', 0.1, clearance_m=-0.004), ball('rear', -0.3, clearance_m=-0.008))
    assert warning.startswith('front and rear would lift the drive wheels by 5.0 mm')


def test_a_robot_without_a_caster_is_told_to_get_supports():
    (warning,) = warnings_of()
    assert warning.startswith('nothing but the drive wheels touches the floor (a balancing robot?)')
