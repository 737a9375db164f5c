"""Plays the cases of the suite to a node, a `Subject`, and records its messages."""

from __future__ import annotations

import math
import time
from typing import Callable, List, NamedTuple, Optional, Protocol, Tuple

import numpy as np

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.conformance.cases import SETTLE_SAMPLES, TIME_BACK_S, Case, Round
from diff_encoder_sim.conformance.mapping import NodeMapping, Settings, Wheels
from diff_encoder_sim.conformance.recording import FramedPose, Recording, Sample, decode_odometry, decode_transforms
from diff_encoder_sim.conformance.reference import counts_of_angles, wrapped
from diff_encoder_sim.drives.message_decoders import encoded_stamp_ns

HISTORY_S = 7200  # fast cases have stamps of the past: nodes may refuse those of the future
ANSWER_S, PAUSE_S, SILENCE_S, SETTLE_S = 0.1, 0.05, 0.2, 1.0  # wall time: an answer; without another one; to the end
MOST_UNANSWERED, UNANSWERED_S = 50, 0.003  # samples; after them the wait for an answer is this short
CASE_LIMIT_S = 60.0  # wall time; 20,000 samples take 20 s on a loaded host
START_SAMPLES = 5  # at rest, which a node with a timer takes in after its first odometry
SUITE_LIMIT_S = 150.0  # wall time
AHEAD = 50  # samples of a stream without an answer


class Unusable(Exception):
    """A node cannot be judged: it does not start, does not answer, or publishes another type; one line."""


class Received(NamedTuple):
    """A serialized message."""

    receipt_ns: int  # time.monotonic_ns()
    content: bytes


class Subject(Protocol):
    """A node under test."""

    odometry: List[Received]  # in the order of arrival; both lists grow in other threads
    transforms: List[Received]

    def start(self, settings: Settings) -> None:
        """Start or restart the node, and connect to it; Unusable if it cannot be."""

    def send(self, sample: Sample) -> None:
        """Publish the input."""

    def wait(self, is_done: Callable[[], bool], limit_s: float) -> bool:
        """Wait until a condition holds; return whether it does, False after the limit or if the node has died."""

    def reset(self) -> bool:
        """Call the reset service; return whether it has answered."""

    def fault(self) -> str:
        """Return why the node cannot be judged further: it has died, or floods; '' if it can."""

    def memory_bytes(self) -> int:
        """Return the resident memory of the node; 0 if unknown."""


class Player:
    """Plays cases; keeps the position of the wheels and the time from one to the next."""

    def __init__(self, subject: Subject, mapping: NodeMapping, wheels: Wheels) -> None:
        self._subject, self._mapping, self._wheels = subject, mapping, wheels
        self._period_ns = round(NANOSECONDS_PER_SECOND / mapping.rate)
        self._is_fast = mapping.pace == 'fast'
        self._next_ns = self._first_ns = (time.time_ns() // NANOSECONDS_PER_SECOND - HISTORY_S) * NANOSECONDS_PER_SECOND
        self._angles_rad = self._zero_rad = np.zeros(2)  # of the wheels; and those at which the counters are zero
        self._modulus = 0
        self._last: Optional[FramedPose] = None
        self._sent = self._unanswered = 0  # samples
        self._pending_ns = 0  # stamp of a last sample whose answer may still come
        self._transforms = 0  # of the recordings so far: a late one belongs to the next
        self._begin()

    @property
    def can_stream(self) -> bool:
        """Return whether the node answers each sample once, and soon: with others, a stream takes minutes."""
        return len(self._subject.odometry) < 3 * self._sent + 100 and self._unanswered < MOST_UNANSWERED

    def _begin(self) -> None:
        """Begin a recording with the next sample and the next message."""
        self._samples: List[Sample] = []
        self._sent_ns: List[int] = []
        self._begun, self._begin_s = len(self._subject.odometry), time.monotonic()

    def start(self, of_round: Round) -> Recording:
        """Start the node for a round, and wait for its first odometry; Unusable if there is none."""
        subject = self._subject
        self._modulus, self._zero_rad = of_round.settings.modulus, np.zeros(2)
        self._angles_rad = np.full(2, (of_round.first_count + 0.5) * 2.0 * math.pi / self._wheels.ppr)
        subject.start(of_round.settings)
        self._begin()
        at_rest = Case(f'start at {of_round.first_count}', np.zeros(1), np.zeros((1, 2)))
        limit_s = self._begin_s + self._mapping.start_timeout
        if not self._is_fast:  # nodes with a timer publish before the first sample
            subject.wait(lambda: False, START_SAMPLES / self._mapping.rate)
        while len(subject.odometry) == self._begun or len(self._samples) < START_SAMPLES:
            if subject.fault() or time.monotonic() > limit_s:
                late = f'no message within {self._mapping.start_timeout:g} s of input'
                raise Unusable(f'{self._mapping.odom}: {subject.fault() or late}')
            self._send(at_rest, 0)
            self._advance(at_rest)
            due = self._begun + len(self._samples) if self._is_fast else math.inf
            subject.wait(lambda: len(subject.odometry) >= due, 1.0 / self._mapping.rate)  # noqa: B023 - called at once
        return self._recording(at_rest, None)

    def play(self, case: Case) -> Recording:
        """Send the samples of a case, and return the messages of the node until it has settled."""
        subject, start = self._subject, self._last
        if case.resets:
            if self._pending_ns:  # an answer after the reset would be taken for one to this case
                last_ns = self._pending_ns
                subject.wait(lambda: encoded_stamp_ns(subject.odometry[-1].content) == last_ns, SILENCE_S)
            start = None if subject.reset() else start
        self._begin()
        before, newest, unanswered = self._begun, -1, 0
        if not self._is_fast:
            self._next_ns = time.time_ns()
        for row in case.rows:
            if case.pace == 'realtime' or not self._is_fast:
                time.sleep(max(0.0, self._begin_s + case.times_s[row] - time.monotonic()))
            is_stepwise = case.pace in ('answered', 'realtime')
            before = len(subject.odometry) if is_stepwise else self._begun + len(self._samples)
            self._send(case, row)
            if case.pace == 'stream' and unanswered < MOST_UNANSWERED:
                unanswered += not subject.wait(self._is_near, 10.0 * ANSWER_S)
            elif self._is_fast and case.pace == 'answered' and newest < row != case.nan_row:
                limit_s = ANSWER_S if self._unanswered < MOST_UNANSWERED else UNANSWERED_S
                unanswered += not subject.wait(lambda: len(subject.odometry) > before, limit_s)  # noqa: B023
            newest = max(newest, row)
            if subject.fault() or time.monotonic() - self._begin_s > CASE_LIMIT_S:
                break
        settled_s = time.monotonic() + (0.0 if self._is_fast else 1.0 / self._mapping.rate)
        self._unanswered += unanswered
        are_answered = case.pace == 'answered' and not unanswered
        self._pending_ns = 0 if are_answered else self._samples[-1].stamp_ns
        subject.wait(lambda: time.monotonic() >= settled_s and self._is_settled(before, are_answered), SETTLE_S)
        self._advance(case)
        return self._recording(case, start)

    def _is_near(self) -> bool:
        """Return whether the node is at most `AHEAD` samples behind: by its stamps, or else by its messages."""
        odometry, samples = self._subject.odometry, self._samples
        due = len(samples) - 1 - AHEAD
        newest_ns = encoded_stamp_ns(odometry[-1].content)
        if due >= 0 and samples[0].stamp_ns <= newest_ns <= samples[-1].stamp_ns:
            return samples[due].stamp_ns <= newest_ns + self._period_ns
        return len(odometry) - self._begun > due

    def _is_settled(self, before: int, are_answered: bool) -> bool:
        """Return whether the pose is that of the last samples, which are at rest.

        It is if each sample has one answer, or else by stamps after a pause, or after a silence.
        """
        odometry, samples = self._subject.odometry, self._samples
        if not self._is_fast:
            return len(odometry) > before
        newest_ns, last_ns = encoded_stamp_ns(odometry[-1].content), samples[-1].stamp_ns
        is_older = self._first_ns <= newest_ns < last_ns  # of a node that answers several times, and is behind
        if are_answered and len(odometry) - self._begun == len(samples) and not is_older:
            return True
        quiet_s = (time.monotonic_ns() - max(self._sent_ns[-1], odometry[-1].receipt_ns)) / NANOSECONDS_PER_SECOND
        is_newest = last_ns - (SETTLE_SAMPLES - 1) * self._period_ns <= newest_ns <= last_ns
        return quiet_s > (PAUSE_S if is_newest else SILENCE_S)

    def _send(self, case: Case, row: int) -> None:
        """Send the sample of a row."""
        if row == case.restart_row:
            self._zero_rad = self._angles_at(case, row)
        back_s = TIME_BACK_S if 0 <= case.back_row <= row else 0.0
        stamp_ns = self._next_ns + round((case.times_s[row] - back_s) * NANOSECONDS_PER_SECOND)
        angles_rad = self._angles_at(case, row) - self._zero_rad
        counts = wrapped(counts_of_angles(angles_rad, self._wheels.ppr), self._modulus)
        speeds_mps = np.zeros(2)
        if row:
            speeds_mps = np.diff(case.travels_m[row - 1 : row + 1], axis=0)[0] / np.diff(case.times_s)[row - 1]
        if row == case.nan_row:
            angles_rad = speeds_mps = np.full(2, np.nan)
        self._samples.append(Sample(stamp_ns, angles_rad, counts, speeds_mps))
        self._sent_ns.append(time.monotonic_ns())
        self._sent += 1
        self._subject.send(self._samples[-1])

    def _angles_at(self, case: Case, row: int) -> np.ndarray:
        return np.asarray(self._angles_rad + case.travels_m[row] / (0.5 * self._wheels.wheel_diameter))

    def _advance(self, case: Case) -> None:
        """Move on to the end of a case: to a whole period of time."""
        self._angles_rad = self._angles_at(case, -1)
        back_s = TIME_BACK_S if case.back_row >= 0 else 0.0
        end_ns = self._next_ns + round((case.times_s[-1] - back_s) * NANOSECONDS_PER_SECOND)
        self._next_ns = (end_ns // self._period_ns + 1) * self._period_ns

    def _recording(self, case: Case, start: Optional[FramedPose]) -> Recording:
        subject, samples, sent_ns = self._subject, self._samples, self._sent_ns
        odometry = [decode_odometry(each.content, each.receipt_ns) for each in subject.odometry[self._begun :]]
        transforms = [
            transform
            for each in subject.transforms[self._transforms :]
            for transform in decode_transforms(each.content, each.receipt_ns)
            if self._mapping.base_frame in (transform.child_frame, transform.child_frame.lstrip('/'))
        ]
        self._transforms = len(subject.transforms)
        rows = sorted({*case.rows} - {case.nan_row})
        travels_m = case.travels_m[rows]
        if self._mapping.is_exact:
            back_m = travels_m - case.travels_m[-1]
            angles_rad = self._angles_rad - self._zero_rad + back_m / (0.5 * self._wheels.wheel_diameter)
            travels_m = counts_of_angles(angles_rad, self._wheels.ppr) * self._wheels.m_per_count
        self._last = odometry[-1] if odometry else self._last
        fault = subject.fault() or ('' if odometry else 'no odometry')
        if not fault and time.monotonic() - self._begin_s > CASE_LIMIT_S:
            fault = f'not finished within {CASE_LIMIT_S:g} s'
        return Recording(case, samples, sent_ns, travels_m, start, odometry, transforms, fault, subject.memory_bytes())


def play_all(rounds: List[Round], player: Player) -> Tuple[List[Recording], str]:
    """Play all rounds; return the recordings, and why the node could not be judged to the end, or ''.

    A fault in an orderly case ends the suite; after another one the node is started again.
    """
    recordings: List[Recording] = []
    end_s = time.monotonic() + SUITE_LIMIT_S
    try:
        for of_round in rounds:
            recordings.append(player.start(of_round))
            for case in of_round.cases:
                if case.pace == 'stream' and not player.can_stream:
                    continue
                recordings.append(player.play(case))
                last = recordings[-1]
                if last.fault and case.is_orderly:
                    raise Unusable(f'{case.name}: {last.fault}')
                if last.is_broken:
                    recordings.append(player.start(of_round))
                if time.monotonic() > end_s:
                    raise Unusable(f'{case.name}: not finished after {SUITE_LIMIT_S:g} s')
    except Unusable as unusable:
        return recordings, str(unusable)
    return recordings, ''
