"""What the odometry node says on /diagnostics."""

import math

import pytest

from diff_encoder_sim.wheels.diagnostics import OdometryDiagnosis
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams

PERIOD_NS, PPR = 50_000_000, 100


class Node:
    """An odometry and its diagnosis, fed as the node feeds them."""

    def __init__(self):
        self.odometry = WheelOdometry(OdometryParams(ppr=PPR))
        self.diagnosis = OdometryDiagnosis(self.odometry, 20.0)
        self.index = 0

    def report(self, index, left, right):
        estimate = self.odometry.update(index * PERIOD_NS, left, right)
        self.diagnosis.take_report(index * PERIOD_NS, estimate is not None)

    def drive(self, reports, zero=0, command=None):
        """Four counts a report: 5.03 rad/s, 0.503 m/s."""
        for _ in range(reports):
            if command is not None:
                self.diagnosis.take_command(*command)
            self.report(self.index, 4 * (self.index - zero), 4 * (self.index - zero))
            self.index += 1
        return self.diagnosis.diagnose()


SPEED_MPS = 80 * math.pi * 0.2 / PPR


def test_all_is_well_in_an_ordinary_drive():
    warning, values = Node().drive(60, command=(SPEED_MPS, 0.0))
    assert warning == ''
    assert values == pytest.approx(
        {
            'counts per second, left': 80.0,
            'counts per second, right': 80.0,
            'reports per second': 20.0,
            'lost reports': 0,
            'late or repeated reports': 0,
            'counter restarts': 0,
            'following error, left [rad/s]': 0.0,
            'following error, right [rad/s]': 0.0,
        },
        abs=1e-9,
    )


def test_what_is_lost_is_warned_of_once_and_stays_counted():
    node = Node()
    node.drive(30)
    node.index += 3
    warning, values = node.drive(30)
    assert warning == 'lost reports: 3' and values['lost reports'] == 3
    warning, values = node.drive(30)
    assert warning == '' and values['lost reports'] == 3


def test_reports_that_odometry_ignores_are_counted():
    node = Node()
    node.drive(30)
    node.report(29, 116, 116)
    node.report(28, 112, 112)
    assert node.drive(1).values['late or repeated reports'] == 2


def test_a_counter_restart_is_warned_of_once():
    node = Node()
    node.drive(60)
    warning, values = node.drive(20, zero=60)
    assert warning == 'counter restarts: 1' and values['counter restarts'] == 1
    assert node.drive(20, zero=60).warning == ''


def test_wheels_that_do_not_follow_are_named_for_as_long():
    node = Node()
    node.drive(30, command=(SPEED_MPS, 0.0))
    assert node.drive(60, command=(0.0, 0.0)).warning == (
        'left wheel has not followed the command for 3.0 s; right wheel has not followed the command for 3.0 s'
    )


def test_a_turn_in_place_commands_the_wheels_against_each_other():
    """By half the separation, 0.2 m."""
    node = Node()
    _, values = node.drive(30, command=(0.0, 2.5))
    turned_radps = 80 * 2 * math.pi / PPR
    assert values['following error, left [rad/s]'] == pytest.approx(turned_radps + 5.0)
    assert values['following error, right [rad/s]'] == pytest.approx(turned_radps - 5.0)
