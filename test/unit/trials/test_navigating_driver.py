"""Navigation in lockstep: at the controller's rate, whatever that of odometry, and over goals that fail."""

import numpy as np
import pytest

from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.navigation.navigator_inputs import STOP
from diff_encoder_sim.trials.publications import Publications
from lockstep_trials import BEND, HALL, blind, distance_and_turn, ended, goal_of, lockstep


class Recorder(Publications):
    """Times [s], commands and whether they are the navigator's."""

    def __init__(self):
        self.commands = []

    def command(self, now_ns, command, is_navigators):
        self.commands.append((now_ns * 1e-9, command, is_navigators))


@pytest.mark.parametrize(
    ('encoder_rate', 'frequency', 'commands_per_s'),
    [(50.0, 20.0, 20.0), (200.0, 20.0, 20.0), (20.0, 10.0, 10.0), (10.0, 20.0, 10.0)],
)
def test_it_controls_at_its_frequency_and_at_most_once_a_report(encoder_rate, frequency, commands_per_s):
    recorder = Recorder()
    *_, last = lockstep(HALL, 1024, encoder_rate=encoder_rate, frequency=frequency, publications=recorder).run()
    times_s = [now_s for now_s, _, is_navigators in recorder.commands if is_navigators]
    assert 1.0 / np.mean(np.diff(times_s)) == pytest.approx(commands_per_s, rel=0.02)
    assert distance_and_turn(last.estimated_pose_in_map, goal_of(HALL))[0] < 0.06


def test_each_stage_of_a_route_is_driven_between_two_steps_of_the_navigator_too():
    """At 50 Hz the route's driver is asked more often than the navigator: it must not see the last goal's success."""
    trial = lockstep(BEND, 1024, encoder_rate=50.0)
    *_, last = trial.run()
    assert trial.ending.outcome is Outcome.SUCCEEDED
    assert distance_and_turn(last.estimated_pose_in_map, goal_of(BEND))[0] < 0.06


def test_a_goal_in_a_wall_fails_with_the_reason():
    ending = ended(lockstep(HALL, route=[{'goal': {'x': -3.0, 'y': 3.1}}]))
    assert ending.outcome is Outcome.ABORTED
    assert 'the goal was not reached' in ending.reason


def test_a_turn_in_place_stops_without_localization_and_goes_on():
    recorder = Recorder()
    trial = lockstep(BEND, publications=recorder)
    scan_of_world = trial._simulator.scan
    trial._simulator.scan = lambda: blind(scan_of_world()) if 1.0 <= trial.time_ns * 1e-9 < 4.0 else scan_of_world()
    rates = {report.stamp_ns * 1e-9: report.odometry.angular_velocity_radps for report in trial.run()}
    blinded = [command for now_s, command, _ in recorder.commands if 2.0 < now_s < 4.0]
    assert len(blinded) > 30 and set(blinded) == {STOP}
    assert max(abs(rate) for now_s, rate in rates.items() if 2.5 < now_s < 4.0) == 0.0
    assert trial.ending.outcome is Outcome.SUCCEEDED
