"""Clauses on pose and twist after the samples of a case."""

from __future__ import annotations

import math
from functools import partial
from typing import Callable, List, Tuple

import numpy as np

from diff_encoder_sim.conformance.cases import TWIST
from diff_encoder_sim.conformance.clauses import (
    Evidence,
    Measured,
    Measures,
    at_zero,
    degrees,
    not_ascending,
    require,
    rounding_of,
)
from diff_encoder_sim.conformance.mapping import ANGLES, COUNTS
from diff_encoder_sim.conformance.recording import FramedPose, Recording

# Tolerances, with their reasons.
SCALE_ERROR = 0.01  # wrong constants, such as a radius for a diameter, make more; rounding on short drives less
SIDEWAYS = 0.1  # of the speed
TWIST_ERROR = 0.1  # filters of a few samples lag behind


def _answers(evidence: Evidence) -> Measured:
    answered = any(each.odometry for each in evidence.recordings)
    return Measured(answered, evidence.unusable if not answered else 'odometry received', 'nav_msgs/Odometry')


def _keeps_running(evidence: Evidence) -> Measured:
    evidence.named('start at')
    return Measured(not evidence.unusable, evidence.unusable or 'all cases played', 'no end, no silence')


def _floor(evidence: Evidence) -> Measured:
    require(evidence.mapping.is_exact and not evidence.mapping.reads_counts, 'the node does not count angles')
    recording, separation_m = evidence.named('across zero')[0], evidence.wheels.wheel_separation
    _, off_rad = evidence.end_errors(recording)
    counts = off_rad * separation_m / evidence.wheels.m_per_count
    return Measured(counts <= 0.5, f'{counts:.2f} counts off', '0.5 counts', recording.name)


def _distance(evidence: Evidence) -> Measured:
    ratios = []  # on straight drives
    for recording in evidence.motions:
        path = recording.expected(evidence.wheels.wheel_separation)
        length_m = float(np.hypot(*path[-1, :2]))
        if np.abs(path[:, 2]).max() < 0.05 and length_m >= 0.04 and recording.case.pace != 'stream':
            found_m = float(np.hypot(*recording.found()[-1][:2]))
            ratios.append((_ratio(found_m, length_m, recording.slack_m), recording.name))
    require(ratios, 'no straight drive')
    ratio, name = max(ratios, key=lambda each: abs(each[0] - 1.0))
    return Measured(abs(ratio - 1.0) <= SCALE_ERROR, f'{ratio:.4f} of the true distance', '0.99 to 1.01', name)


def _ratio(found: float, true: float, slack: float) -> float:
    """Return found / true, as near to 1 as the slack of `found` allows."""
    return 1.0 + math.copysign(max(0.0, abs(found - true) - slack), found - true) / true


def _turn_ratio(evidence: Evidence) -> Tuple[float, float, str]:
    """Return turned and true angle [rad] of the slowest turn, whose steps are below half a turn in any unit."""
    turns = []
    for recording in evidence.motions:
        turn_rad = recording.expected(evidence.wheels.wheel_separation)[-1][2]
        if abs(turn_rad) >= 0.1 and len(recording.odometry) > 5 and recording.case.pace != 'stream':
            turns.append((abs(turn_rad) / len(recording.odometry), turn_rad, recording))
    require(turns, 'no turn')
    _, turn_rad, recording = min(turns, key=lambda each: each[0])
    slack_rad = 2.0 * recording.slack_m / evidence.wheels.wheel_separation
    start = (recording.start or recording.odometry[0]).pose[2]
    yaws_rad = np.unwrap([start, *(message.pose[2] for message in recording.odometry)])
    found_rad = float(yaws_rad[-1] - yaws_rad[0])
    return turn_rad * _ratio(found_rad, turn_rad, slack_rad), float(turn_rad), recording.name


def _direction(evidence: Evidence) -> Measured:
    found_rad, true_rad, name = _turn_ratio(evidence)
    value = f'{degrees(found_rad)} for a turn of {degrees(true_rad)}'
    return Measured(found_rad * true_rad > 0.0, value, 'the same sign', name)


def _angle(evidence: Evidence) -> Measured:
    found_rad, true_rad, name = _turn_ratio(evidence)
    ratio = abs(found_rad / true_rad)
    value = f'{ratio:.4f} of the true angle'
    return Measured(abs(ratio - 1.0) <= SCALE_ERROR, value, '0.99 to 1.01', name)


def _arcs(evidence: Evidence) -> Measured:
    motions = evidence.motions
    bursts = [each for each in evidence.recordings if each.name == 'burst' and not each.has_ended]
    if bursts and not evidence.worst_end(bursts).is_met:  # which clause 4.4 judges; a stream is another one
        motions = [each for each in motions if each.case.pace != 'stream']
    measured = evidence.worst_end(motions)
    return measured._replace(value=f'worst of {len(motions)}: {measured.value}')


def _first_count(evidence: Evidence) -> Measured:
    require(evidence.mapping.commands, evidence.missing)
    starts = evidence.some(each for each in evidence.named('start at') if each.name != 'start at 0')
    return at_zero(evidence, [(message.pose, start.name) for start in starts for message in start.odometry])


def _wraps(evidence: Evidence) -> Measured:
    require(evidence.mapping.counter_bits, 'the mapping has no counter_bits')
    return evidence.worst_end(evidence.named('wrap of'))


def _restart(evidence: Evidence) -> Measured:
    require({*COUNTS, *ANGLES} & set(evidence.mapping.input.values()), 'speeds have no counter')
    recording = evidence.named('counter restart')[0]
    step_m = float(abs(np.diff(recording.travels_m, axis=0)).max())
    return evidence.worst_end([recording], step_m, 2.0 * step_m / evidence.wheels.wheel_separation)


def _ends(
    evidence: Evidence, name: str, count_bad: Callable[[List[FramedPose]], int] = lambda _: 0, bad: str = ''
) -> Measured:
    """Judge the pose at the end of a case, and messages that are bad in another way."""
    recording = evidence.named(name)[0]
    measured, count = evidence.worst_end([recording]), count_bad(recording.odometry)
    value = f'{measured.value}; {count} {bad}' if bad else measured.value
    return measured._replace(is_met=measured.is_met and not count, value=value)


def _twice(messages: List[FramedPose]) -> int:
    return len(messages) - len({message.stamp_ns for message in messages})


def _nan(evidence: Evidence) -> Measured:
    require(not evidence.mapping.reads_counts, 'counts are whole numbers')
    bad = 'messages not finite'
    return _ends(evidence, 'NaN', lambda found: sum(not np.isfinite(each.numbers).all() for each in found), bad)


def _time_back(evidence: Evidence) -> Measured:
    recording = evidence.named('time back')[0]
    first = recording.case.back_row + 2  # two samples to notice it
    rows = {sample.stamp_ns: row for row, sample in enumerate(recording.samples) if row >= first}
    found = [(rows[each.stamp_ns], each) for each in recording.odometry if each.stamp_ns in rows]
    if not found:  # other stamps: by the order
        found = list(zip(rows.values(), recording.odometry[-len(rows) :]))
    if len(found) < 2 or recording.fault:
        answered = recording.fault or f'{len(found)} messages after it, for {len(rows)} samples'
        return Measured(False, answered, 'messages', recording.name)
    messages = [message for _, message in found]
    travels_m = recording.travels_m[found[0][0] :]
    part = recording._replace(start=messages[0], odometry=messages, travels_m=travels_m)
    before, after = recording.odometry[: recording.case.back_row], recording.odometry[recording.case.back_row :]
    fastest, usual = (max((float(np.abs(each.twist).max()) for each in some), default=0.0) for some in (after, before))
    measured = evidence.worst_end([part])
    is_met = measured.is_met and fastest <= 3.0 * usual
    return measured._replace(is_met=is_met, value=f'{measured.value}; twist up to {fastest:.3g}')


def _mean_twist(recording: Recording) -> np.ndarray:
    """Return (3,) the mean twist of the middle of a recording: without its first and last quarter."""
    quarter = len(recording.odometry) // 4
    middle = recording.odometry[quarter : len(recording.odometry) - quarter]
    return np.asarray(np.mean([message.twist for message in middle], axis=0))


def _twist_frame(evidence: Evidence) -> Measured:
    sideways = []
    for recording in evidence.motions:
        for message in recording.odometry:
            speed_mps = float(np.hypot(*message.twist[:2]))
            if speed_mps > 0.05 or not math.isfinite(speed_mps):
                sideways.append((abs(message.twist[1]) / speed_mps, recording.name))
    require(sideways, 'no twist above 0.05 m/s')
    share, name = max((math.inf if math.isnan(share) else share, name) for share, name in sideways)
    value = f'{100.0 * share:.0f} % of the speed sideways'
    return Measured(share <= SIDEWAYS, value, f'{100.0 * SIDEWAYS:.0f} %', name)


def _twist_sign(evidence: Evidence) -> Measured:
    wrong, compared = [], 0
    for recording in evidence.motions:
        path = recording.expected(evidence.wheels.wheel_separation)
        steps_m, turns_rad = np.diff(recording.travels_m.mean(axis=1)), np.diff(path[:, 2])
        linear, _, angular = _mean_twist(recording)
        for mean, steps, rounding in zip((linear, angular), (steps_m, turns_rad), rounding_of(evidence)):
            if abs(steps.sum()) > 0.2 + rounding and (steps * np.sign(steps.sum()) >= 0.0).all():
                compared += 1
                wrong += [recording.name] if mean * steps.sum() <= 0.0 or not math.isfinite(mean) else []
    value = f'wrong in {len(wrong)} of {compared}{": " + wrong[0] if wrong else ""}'
    return Measured(not wrong, value, 'none', wrong[0] if wrong else '')


def _twist_size(evidence: Evidence) -> Measured:
    recorded = [each for each in evidence.motions if any(each.twist)]
    recording = max(recorded, key=lambda each: abs(each.twist[0])) if recorded else evidence.named('twist')[0]
    expected = np.array(recording.twist if recorded else TWIST)
    linear, _, angular = _mean_twist(recording)
    rounding = np.array(rounding_of(evidence)) / (0.5 * math.pi)  # seconds in the middle
    is_met = bool((abs(np.array([linear, angular]) - expected) <= TWIST_ERROR * abs(expected) + rounding).all())
    value = f'{linear:.3g} m/s and {angular:.3g} rad/s at {expected[0]:.3g} and {expected[1]:.3g}'
    return Measured(is_met, value, f'{100.0 * TWIST_ERROR:.0f} %, and rounding', recording.name)


MEASURES: Measures = {
    '1.1': _answers,
    '1.2': _keeps_running,
    '2.1': _floor,
    '2.2': _distance,
    '2.3': _direction,
    '2.4': _angle,
    '2.5': _arcs,
    '3.1': _first_count,
    '3.2': _wraps,
    '3.3': _restart,
    '4.1': partial(_ends, name='repeated samples', count_bad=_twice, bad='stamps twice'),
    '4.2': partial(_ends, name='late samples', count_bad=not_ascending, bad='stamps go back'),
    '4.3': partial(_ends, name='lost samples'),
    '4.4': partial(_ends, name='burst'),
    '4.5': _nan,
    '4.6': _time_back,
    '5.1': _twist_frame,
    '5.2': _twist_sign,
    '5.3': _twist_size,
}
