"""Scripted trials: the robot drives once, and the chain of each trial runs on that drive."""

from __future__ import annotations

import contextlib
import heapq
import operator
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.topics import RecordMode
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.simulation.state import TICK_NS
from diff_encoder_sim.trials.campaign_cells import TrialSetup
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial, Report, chain_of, fusion_of
from diff_encoder_sim.trials.navigating_driver import NO_NAVIGATION
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import latency_ns
from diff_encoder_sim.wheels.odometry import wheel_speeds_mps

# Place of a message in its bag: the tick, and the order within the tick. Live nodes publish in this order.
Place = Tuple[int, int]
_REPORTS, _ODOMETRY = 1, 3
_ORDER = {
    **dict.fromkeys((topics.MODEL_STATES, topics.WORLD_POSE, topics.CMD_VEL, topics.SCAN), 2),
    topics.TRIAL_RESULT: 4,
}

_Event = Tuple[Place, Callable[..., None], Tuple[Any, ...]]  # a call that publishes a message


class _SharedMessages(TrialBag):
    """Messages that do not depend on the encoder, encoded in memory, without a file."""

    def __init__(self, mode: RecordMode) -> None:
        super().__init__('', mode)
        self._topics.pop(topics.TRIAL, None)
        self._encoded: List[Tuple[str, str, int, bytes]] = []

    def events(self, bag: TrialBag) -> Iterator[_Event]:
        """Return the messages in order, to be published to a bag."""
        self.write_waiting()
        for topic, node, time_ns, message in self._encoded:
            yield (time_ns // TICK_NS, _ORDER.get(topic, 0)), bag.publish, (topic, node, time_ns, bytes, message)

    def write_waiting(self) -> None:
        """Encode the messages that wait."""
        waiting, self._waiting = self._waiting, []
        self._encoded += [(topic, node, time_ns, encode(*values)) for topic, node, time_ns, encode, values in waiting]


def run_scripted_trials(trials: Sequence[TrialSetup], robot_file: Path) -> Tuple[LockstepTrial, List[Optional[Report]]]:
    """Run trials that differ only in encoder and odometry; each has the same bag as if it ran separately.

    Returns the drive, and the last report of each trial; None if the drive ended before the first.
    """
    plan, params, options = next((each for each in trials if each.plan.trial.fusion != 'none'), trials[0])
    with contextlib.ExitStack() as opened:
        bags = [opened.enter_context(TrialBag(each.bag, options.record, each.bag_format)) for each, *_ in trials]
        shared = _SharedMessages(options.record)
        robot = LockstepTrial(plan, robot_file, params, Publications(shared, params, 'scripted'))
        for _ in robot.run():
            pass
        log = robot.log
        drive, commands = Drive(TICK_NS * np.arange(len(log)), log[:, :2]), log[:, 2:]
        return robot, [_run_chain(each, robot, drive, commands, bag, shared) for each, bag in zip(trials, bags)]


def _run_chain(
    setup: TrialSetup, robot: LockstepTrial, drive: Drive, commands: np.ndarray, bag: TrialBag, shared: _SharedMessages
) -> Optional[Report]:
    """Write the bag of a trial, and return its last report; `commands` (n, 2) are linear [m/s] and angular [rad/s]."""
    trial, params = setup.plan.trial, setup.params
    publications = Publications(bag, params, trial.nav)
    publications.trial(trial)
    start, odometry_latency_ns = trial.test.start.pose(), latency_ns(params.latency.odometry)
    speeds_mps = np.column_stack(wheel_speeds_mps(commands[:, 0], commands[:, 1], params.odometry.wheel_separation))
    run = chain_of(trial, params).run(drive, commands=speeds_mps)
    # A collision ends its tick before odometry.
    ticks_with_odometry = len(drive) - (robot.ending.outcome is Outcome.COLLISION)
    times_ns, samples = (TICK_NS * run.rows[0]).tolist(), run.samples()
    reports: List[_Event] = [
        ((now_ns // TICK_NS, _REPORTS), publications.encoder_pulse, (now_ns, sample))
        for now_ns, sample in zip(times_ns, samples)
    ]
    odometry: List[_Event] = []
    last: Optional[Report] = None
    fusion = fusion_of(trial, params)
    fused = fusion.run(robot.imu_log, zip(times_ns, (sample[:3] for sample in samples))) if fusion else ()
    estimates = [(time_ns, each, True) for time_ns, each in fused]
    estimates += [(time_ns, each, False) for time_ns, each in zip(times_ns, run.estimates()) if each is not None]
    for time_ns, estimate, is_fused in sorted(estimates, key=operator.itemgetter(0)):
        due_ns = time_ns + odometry_latency_ns
        due_tick = -(-due_ns // TICK_NS)
        if due_tick < ticks_with_odometry:
            # Odometry begins at the surveyed start pose, as by scripted_drive_node's transform.
            pose, place = start.compose(estimate.base_pose_in_odom), (due_tick, _ODOMETRY)
            odometry.append((place, publications.odometry, (due_ns, estimate, is_fused)))
            if is_fused or fusion is None:
                odometry.append((place, publications.global_pose, (due_ns, estimate.stamp_ns, pose)))
                last = Report(estimate.stamp_ns, robot.true_pose_in_map, estimate, pose, None, NO_NAVIGATION)
    for _, publish, message in heapq.merge(shared.events(bag), reports, odometry, key=lambda event: event[0]):
        publish(*message)
    return last
