"""Clauses on messages, covariance, service and memory."""

from __future__ import annotations

import math
from functools import partial
from typing import List

import numpy as np

from diff_encoder_sim.conformance.clauses import (
    Evidence,
    Measured,
    Measures,
    at_zero,
    not_ascending,
    pose_text,
    require,
)
from diff_encoder_sim.conformance.recording import FramedPose
from diff_encoder_sim.conformance.reference import exact_path, nees, pose_errors, relative_pose

RATE_ERROR = 0.25  # timers miss a sample of twenty, and a loaded host delays some
QUATERNION_ERROR = 1e-3  # float32; tf2 refuses 1e-2
LEAST_NEES, MOST_NEES = 0.5, 2.0  # of 3: the mean of 40 honest drives is within 0.64 to 1.46 in 99.9 %
BYTES_PER_MESSAGE = 50  # a stored pose has more; resident memory is constant to 1 MB in 20,000 messages
SAME_POSE_M = 1e-6  # float64 in both messages
MESSAGES_PER_HOUR = 3_600_000  # at 1 kHz
NO_TRANSFORM, NO_RESET = 'the node publishes no transform', 'the node has no reset service'


def _odometry(evidence: Evidence) -> List[FramedPose]:
    return [message for recording in evidence.orderly for message in recording.odometry]


def _transforms(evidence: Evidence) -> List[FramedPose]:
    return [transform for recording in evidence.orderly for transform in recording.transforms]


def _stamps(evidence: Evidence) -> Measured:
    require(evidence.has_stamps, 'the input has no stamps')
    stamps = {sample.stamp_ns for recording in evidence.recordings for sample in recording.samples}
    messages = _odometry(evidence)
    wrong = [message for message in messages if message.stamp_ns not in stamps]
    return Measured(not wrong, f'{len(wrong)} of {len(messages)} stamps of no sample', 'none')


def _ascending(evidence: Evidence, kind: str) -> Measured:
    require(kind == 'odometry' or evidence.mapping.publish_tf, NO_TRANSFORM)
    wrong = sum(not_ascending(getattr(recording, kind)) for recording in evidence.orderly)
    return Measured(not wrong, f'{wrong} stamps repeat or go back', 'none')


def _transforms_equal(evidence: Evidence) -> Measured:
    require(evidence.mapping.publish_tf, NO_TRANSFORM)
    by_stamp = {each.stamp_ns: each for each in _transforms(evidence)}
    messages, missing, worst = _odometry(evidence), 0, (0.0, 0.0)
    for message in messages:
        transform = by_stamp.get(message.stamp_ns)
        if transform is None:
            missing += 1
        else:
            worst = max(worst, pose_errors(transform.pose, message.pose))
    value = f'{missing} of {len(messages)} without transform; {pose_text(*worst)} apart'
    is_met = missing <= 0.01 * len(messages) and max(worst) <= SAME_POSE_M
    return Measured(is_met, value, f'1 %; {1e3 * SAME_POSE_M:g} mm')


def _frames(evidence: Evidence) -> Measured:
    mapping = evidence.mapping
    wanted = mapping.odom_frame, mapping.base_frame
    messages = _odometry(evidence) + (_transforms(evidence) if mapping.publish_tf else [])
    wrong = {(each.frame, each.child_frame) for each in messages} - {wanted}
    value = ', '.join(f'{frame or "(empty)"} -> {child or "(empty)"}' for frame, child in sorted(wrong))
    return Measured(not wrong, value or ' -> '.join(wanted), ' -> '.join(wanted))


def _quaternions(evidence: Evidence) -> Measured:
    norms = [float(np.linalg.norm(each.numbers[3:7])) for each in [*_odometry(evidence), *_transforms(evidence)]]
    worst = max(norms, key=lambda norm: abs(norm - 1.0))
    return Measured(abs(worst - 1.0) <= QUATERNION_ERROR, f'norm {worst:.6g}', f'1 ± {QUATERNION_ERROR:g}')


def _rate(evidence: Evidence) -> Measured:
    recording = evidence.named('rate')[0]
    rate_hz = evidence.mapping.rate
    spans_ns = np.ptp(recording.sent_ns), np.ptp([message.receipt_ns for message in recording.odometry])
    found_hz = 1e9 * (len(recording.odometry) - 1) / max(spans_ns)
    is_met = abs(found_hz / rate_hz - 1.0) <= RATE_ERROR
    allowed = f'{rate_hz:g} Hz ± {100.0 * RATE_ERROR:.0f} %'
    return Measured(is_met, f'{found_hz:.1f} Hz', allowed, recording.name)


def _latency(evidence: Evidence) -> Measured:
    recording = evidence.named('rate')[0]
    sent_ns = {sample.stamp_ns: sent_ns for sample, sent_ns in zip(recording.samples, recording.sent_ns)}
    delays_ns = []
    for message in recording.odometry:
        newest_ns = max((each for each in recording.sent_ns if each < message.receipt_ns), default=math.nan)
        delays_ns.append(message.receipt_ns - sent_ns.get(message.stamp_ns, newest_ns))  # without its stamp: the newest
    median_ms = float(np.nanmedian(delays_ns)) * 1e-6
    limit_ms = 1e3 / evidence.mapping.rate
    return Measured(median_ms <= limit_ms, f'{median_ms:.1f} ms (median)', f'{limit_ms:g} ms', recording.name)


def _positive_definite(evidence: Evidence) -> Measured:
    worst, name = math.inf, ''
    for recording in evidence.motions:
        for message in recording.odometry:
            for matrix in (message.covariance, message.twist_covariance):
                least = float(np.linalg.eigvalsh(matrix).min()) if np.isfinite(matrix).all() else -math.inf
                least = least if np.allclose(matrix, matrix.T, rtol=0.0, atol=1e-6 * abs(matrix).max()) else -math.inf
                if least < worst:
                    worst, name = least, recording.name
    value = f'least eigenvalue {worst:.3g}' if math.isfinite(worst) else 'not symmetric, or not finite'
    return Measured(worst > 0.0, value, 'above 0: pose (x, y, yaw) and twist', name)


def _grows(evidence: Evidence) -> Measured:
    motions = evidence.motions
    first, last = motions[0].odometry[0].covariance, motions[-1].odometry[-1].covariance
    ratios = np.diag(last) / np.diag(first)
    value = 'x, y and yaw grow by ' + ', '.join(f'{ratio:.3g}' for ratio in ratios)
    return Measured(bool((ratios > 1.0).all()), value, 'each above 1', motions[-1].name)


def _honest(evidence: Evidence, name: str) -> Measured:
    require(evidence.mapping.reset, NO_RESET)
    found = []
    for recording in evidence.named(f'honest {name}'):
        require(recording.start is None and recording.odometry, 'the reset service does not answer')
        first, last = recording.odometry[0], recording.odometry[-1]
        true_path = exact_path(recording.case.true_travels_m, evidence.wheels.wheel_separation)
        error = relative_pose(first.pose, last.pose) - true_path[-1]
        found.append(nees(error, last.covariance) / 3.0)
    mean = float(np.mean(found))
    value = f'NEES / 3 = {mean:.2f}, mean of {len(found)} drives'
    return Measured(LEAST_NEES <= mean <= MOST_NEES, value, f'{LEAST_NEES:g} to {MOST_NEES:g}', f'honest {name} 1')


def _reset(evidence: Evidence) -> Measured:
    require(evidence.mapping.reset, NO_RESET)
    recording = evidence.named('reset')[0]
    if recording.start is not None or not recording.odometry:
        return Measured(False, 'no answer', 'pose zero', recording.name)
    return at_zero(evidence, [(recording.odometry[0].pose, recording.name)])


def _memory(evidence: Evidence) -> Measured:
    recording = evidence.named('memory')[0]
    before = evidence.recordings[[each.name for each in evidence.recordings].index('memory') - 1]
    require(before.memory_bytes and recording.memory_bytes, 'not a process of this computer')
    per_message = max(0, recording.memory_bytes - before.memory_bytes) / len(recording.samples)
    growth_mb, allowed_mb = MESSAGES_PER_HOUR * 1e-6 * np.array([per_message, BYTES_PER_MESSAGE])
    value = f'{growth_mb:.0f} MB an hour, by {len(recording.samples)} samples'
    return Measured(per_message <= BYTES_PER_MESSAGE, value, f'{allowed_mb:.0f} MB', recording.name)


MEASURES: Measures = {
    '6.1': _stamps,
    '6.2': partial(_ascending, kind='odometry'),
    '6.3': partial(_ascending, kind='transforms'),
    '6.4': _transforms_equal,
    '6.5': _frames,
    '6.6': _quaternions,
    '6.7': _rate,
    '6.8': _latency,
    '8.1': _positive_definite,
    '8.2': _grows,
    '8.3': partial(_honest, name='rounding'),
    '8.4': partial(_honest, name='slip'),
    '7.1': _reset,
    '7.2': _memory,
}
