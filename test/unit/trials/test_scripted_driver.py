"""Scripted drives in lockstep."""

import pytest

from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.publications import Publications
from lockstep_trials import HALL, ended, lockstep


def test_a_scripted_drive_needs_no_localization_and_is_published_on_the_map():
    *_, last = lockstep(HALL, 1024, nav='scripted', drive=[{'straight': 1.0}]).run()
    assert last.true_pose_in_map.x_m == pytest.approx(-2.0, abs=1e-3)
    assert last.estimated_pose_in_map.x_m == pytest.approx(-2.0, abs=2e-3)
    assert last.estimate is None


@pytest.mark.parametrize('encoder_rate', [7.0, 50.0])
def test_its_commands_do_not_depend_on_the_rate_of_the_encoder(encoder_rate):
    drives = [
        lockstep(HALL, nav='scripted', drive=[{'straight': 0.5}], encoder_rate=rate) for rate in (20.0, encoder_rate)
    ]
    for trial in drives:
        assert ended(trial).outcome is Outcome.SUCCEEDED
    assert drives[0].true_pose_in_map == drives[1].true_pose_in_map


@pytest.mark.parametrize('takes_scans', [False, True])
def test_scans_are_taken_where_they_are_published_alone(takes_scans):
    """At 10 Hz from the start on; a script looks at none."""
    stamps_ns = []

    class Recorder(Publications):
        def scan(self, scan):
            stamps_ns.append(scan.stamp_ns)

    Recorder.takes_scans = takes_scans
    trial = lockstep(HALL, nav='scripted', drive=[{'straight': 0.5}], publications=Recorder())
    assert ended(trial).outcome is Outcome.SUCCEEDED
    assert stamps_ns == ([*range(0, trial.time_ns + 1, 100_000_000)] if takes_scans else [])
