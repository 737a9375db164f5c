"""Wheels that do what is commanded, and such as do not."""

import math

import pytest

from diff_encoder_sim.wheels.diagnostics import FollowingError

PERIOD_S, PERIOD_NS = 0.05, 50_000_000
WINDOW_RADPS, TIMEOUT_S = 1.0, 1.0


class Robot:
    """Two wheels whose commanded and true speeds are set."""

    def __init__(self, ppr=40):
        self.rad_per_count = 2 * math.pi / ppr
        self.watch = FollowingError((self.rad_per_count,) * 2, WINDOW_RADPS, TIMEOUT_S)
        self.angles, self.time_ns = [0.3, 0.1], 0

    def run(self, seconds, commanded, turning, renewed=True):
        for _ in range(round(seconds / PERIOD_S)):
            if renewed:
                self.watch.take_command(*commanded)
            self.time_ns += PERIOD_NS
            self.angles = [angle + speed * PERIOD_S for angle, speed in zip(self.angles, turning)]
            self.watch.take_report(self.time_ns, *(math.floor(angle / self.rad_per_count) for angle in self.angles))
        return self.watch.lasts_s()


@pytest.mark.parametrize('ppr', [12, 40, 4096])
@pytest.mark.parametrize('speed', [0.0, 0.2, 4.5, -4.5])
def test_wheels_that_follow_have_no_error_whatever_the_resolution(ppr, speed):
    robot = Robot(ppr)
    for _ in range(100):
        assert robot.run(0.1, (speed, -speed), (speed, -speed)) == (0.0, 0.0)


def test_a_blocked_wheel_is_noticed_after_the_timeout_and_forgotten_when_it_turns_again():
    robot = Robot()
    robot.run(2.0, (4.5, 4.5), (4.5, 4.5))
    assert robot.run(1.0, (4.5, 4.5), (0.0, 4.5)) == (0.0, 0.0)
    left_s, right_s = robot.run(1.0, (4.5, 4.5), (0.0, 4.5))
    assert 1.7 < left_s <= 2.0 and right_s == 0.0
    assert robot.watch.errors_radps == pytest.approx((-4.5, 0.0), abs=robot.rad_per_count / 0.25)
    assert robot.run(1.0, (4.5, 4.5), (4.5, 4.5)) == (0.0, 0.0)


def test_a_wheel_that_counts_the_wrong_way_is_noticed():
    assert Robot().run(3.0, (2.0, 2.0), (2.0, -2.0))[1] > 2.0


def test_without_commands_there_is_nothing_to_follow():
    robot = Robot()
    assert robot.run(3.0, (0.0, 0.0), (4.5, 4.5), renewed=False) == (0.0, 0.0)
    robot.run(1.0, (4.5, 4.5), (4.5, 4.5))
    assert robot.run(5.0, (4.5, 4.5), (0.0, 0.0), renewed=False) == (0.0, 0.0)


def test_a_beginning_anew_forgets_the_counts_and_keeps_the_command():
    robot = Robot()
    robot.run(2.0, (4.5, 4.5), (4.5, 4.5))
    robot.watch.restart()
    robot.angles = [0.0, 0.0]
    assert robot.run(3.0, (4.5, 4.5), (4.5, 4.5)) == (0.0, 0.0)
    assert robot.run(3.0, (4.5, 4.5), (0.0, 0.0))[0] > 2.0
