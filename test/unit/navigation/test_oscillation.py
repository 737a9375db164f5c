"""Directions that past commands rule out."""

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.dwa import OscillationMemory
from navigation_scenes import dwa_params


def test_turning_back_binds_until_the_robot_has_got_away():
    memory = OscillationMemory(dwa_params())
    memory.update(IDENTITY, 0.0, 0.3)
    assert all(memory.allowed())
    memory.update(IDENTITY, 0.0, -0.3)  # turned back: only right from here
    assert memory.allowed() == (True, True, False, True)
    memory.update(Pose2D(0.04, 0.0, -0.15), 0.0, -0.3)  # neither 0.05 m nor 0.2 rad
    assert not all(memory.allowed())
    memory.update(Pose2D(0.04, 0.0, -0.25), 0.0, -0.3)
    assert all(memory.allowed())


def test_forward_and_backward_bind_too():
    memory = OscillationMemory(dwa_params(min_vel_x=-0.2))
    memory.update(IDENTITY, 0.1, 0.0)
    memory.update(IDENTITY, -0.1, 0.0)
    assert memory.allowed() == (False, True, True, True)
    memory.update(Pose2D(-0.06, 0.0, 0.0), -0.1, 0.0)
    assert all(memory.allowed())


def test_turning_counts_only_on_the_spot():
    memory = OscillationMemory(dwa_params())
    for angular in (0.3, -0.3, 0.3, -0.3):
        memory.update(IDENTITY, 0.2, angular)
    assert all(memory.allowed())
