"""Scripted drives: profiles in closed form, and commands that add up exactly."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive, Trapezoid

profiles = st.builds(Trapezoid, st.floats(-50, 50), st.floats(0.1, 3), st.floats(0.1, 5))


def definition(*segments, **limits):
    given = {'name': 'T', 'world': 'hallway', 'drive': list(segments), 'limits': limits}
    return TestDefinition.from_mapping(given, 'test')


def test_profiles_by_hand():
    long = Trapezoid(distance=20.0, top_speed=0.5, acceleration=1.0)
    assert long.ramp_s == 0.5 and long.duration_s == pytest.approx(40.5)
    assert [long.covered(time_s) for time_s in (0.5, 20.25, 40.5, 99)] == pytest.approx([0.125, 10.0, 20.0, 20.0])
    short = Trapezoid(distance=-0.04, top_speed=0.5, acceleration=1.0)  # never reaches its top speed
    assert (short.ramp_s, short.duration_s, short.covered(0.2)) == pytest.approx((0.2, 0.4, -0.02))


@given(profiles, st.lists(st.floats(0, 1), min_size=2, max_size=20))
def test_a_profile_covers_its_distance_within_the_limits_of_speed_and_acceleration(profile, fractions):
    covered = [profile.covered(part * profile.duration_s) for part in (0.0, 0.5, 1.0)]
    assert covered == pytest.approx([0.0, 0.5 * profile.distance, profile.distance], abs=1e-9)
    step_s = 1e-3
    for time_s in (fraction * profile.duration_s for fraction in fractions):
        here, ahead, beyond = (profile.covered(time_s + index * step_s) for index in range(3))
        assert abs(ahead - here) <= profile.top_speed * step_s * (1 + 1e-6) + 1e-9
        assert abs(beyond - 2 * ahead + here) <= profile.acceleration * step_s**2 * (1 + 1e-6) + 1e-9


@given(st.floats(0.1, 20), st.one_of(st.floats(0.02, 0.3), st.just(1000.0)))
def test_commands_held_for_a_period_add_up_to_the_exact_distance(distance, period_s):
    drive = ScriptedDrive(definition({'straight': distance}, {'turns': -1.0}, {'turns': 0.5}))
    steps = math.ceil(drive.duration_s / period_s)
    commands = [drive.command_at(index * period_s, period_s) for index in range(steps)]
    assert sum(linear for linear, _ in commands) * period_s == pytest.approx(distance)
    assert sum(angular for _, angular in commands) * period_s == pytest.approx(-math.pi)


@given(st.floats(-3, 3), st.floats(0.01, 2).map(lambda turns: 1.5 - turns))
def test_an_arc_keeps_its_radius_within_the_limits(radius, turns):
    drive = ScriptedDrive(definition({'arc': {'radius': radius, 'turns': turns}}, speed=0.5, angular_speed=0.7))
    period_s, (distance_m, turn_rad) = 0.1, definition({'arc': {'radius': radius, 'turns': turns}}).drive[0].motion
    commands = [drive.command_at(index * period_s, period_s) for index in range(math.ceil(drive.duration_s / period_s))]
    linear, angular = zip(*commands)
    assert sum(linear) * period_s == pytest.approx(distance_m, abs=1e-9)
    assert sum(angular) * period_s == pytest.approx(turn_rad)
    side = math.copysign(radius, radius * turns)
    assert all(each == pytest.approx(side * other, abs=1e-9) for each, other in commands)
    assert max(map(abs, linear)) < 0.5 + 1e-9 and max(map(abs, angular)) < 0.7 + 1e-9


def test_segments_follow_one_another_with_a_pause():
    drive = ScriptedDrive(definition({'straight': 1.0}, {'turns': 1.0}, speed=1.0, acceleration=1.0))
    assert drive.command_at(0.99, 0.02)[0] == pytest.approx(1.0, abs=0.02)
    assert drive.command_at(2.1, 0.3) == (0.0, 0.0)
    linear, angular = drive.command_at(4.0, 0.1)
    assert linear == 0.0 and angular == pytest.approx(1.0)
    assert drive.command_at(drive.duration_s, 1.0) == (0.0, 0.0)
    longer = ScriptedDrive(definition({'straight': 1.0}, {'stop': 7.0}, {'turns': 1.0}, speed=1.0, acceleration=1.0))
    assert longer.duration_s == pytest.approx(drive.duration_s + 7.5)
