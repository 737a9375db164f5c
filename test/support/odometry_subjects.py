"""Odometry nodes without ROS for the conformance suite: this package's, and a simple one, right or with one fault."""

import math
from collections import deque
from unittest import mock

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, move_along_arc
from diff_encoder_sim.conformance import playing
from diff_encoder_sim.conformance.cases import plan
from diff_encoder_sim.conformance.clauses import Evidence
from diff_encoder_sim.conformance.mapping import NodeMapping, Wheels
from diff_encoder_sim.conformance.playing import Player, Received, play_all
from diff_encoder_sim.drives.message_encoders import encode_odometry, encode_planar_tf
from diff_encoder_sim.wheels.covariance import PlanarCovariance, propagate_motion_noise, quantisation_covariance
from diff_encoder_sim.wheels.odometry import OdometryEstimate, TwistCovariance, WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder

ANGLES = {'/joint_states.position[0]': 'left_rad', '/joint_states.position[1]': 'right_rad'}
COUNTS = {'/encoder_pulse.pulses[0]': 'left_count', '/encoder_pulse.pulses[1]': 'right_count'}
FRAMES = ('odom', 'base_link')
JOINTS = ('left_wheel_joint', 'right_wheel_joint')

# The clause that each wrong node fails, and the input that shows it.
FAULTS = {
    'never answers': ('1.1', COUNTS),
    'dies at speed': ('1.2', COUNTS),
    'truncates': ('2.1', ANGLES),
    'diameter as radius': ('2.2', COUNTS),
    'integer division': ('2.2', COUNTS),
    'left and right swapped': ('2.3', COUNTS),
    'degrees as radians': ('2.4', COUNTS),
    'Euler integration': ('2.5', COUNTS),
    'first sample as motion': ('3.1', COUNTS),
    'no wrap': ('3.2', COUNTS),
    'restart as motion': ('3.3', COUNTS),
    'repeats published again': ('4.1', COUNTS),
    'late samples integrated': ('4.2', COUNTS),
    'a gap discards counts': ('4.3', COUNTS),
    'a burst discards counts': ('4.4', COUNTS),
    'NaN passes': ('4.5', ANGLES),
    'dies of NaN': ('4.5', ANGLES),
    'silent after time goes back': ('4.6', COUNTS),
    'twist in odom': ('5.1', COUNTS),
    'unsigned twist': ('5.2', COUNTS),
    'receipt time differences': ('5.3', COUNTS),
    'stamp of now': ('6.1', COUNTS),
    'every message twice, every other not': ('6.2', COUNTS),
    'transform twice': ('6.3', COUNTS),
    'transform inverted': ('6.4', COUNTS),
    'no transform': ('6.4', COUNTS),
    'leading slash': ('6.5', COUNTS),
    'wrong child frame': ('6.5', COUNTS),
    'quaternion not normalised': ('6.6', COUNTS),
    'ten times': ('6.7', COUNTS),
    'every third sample': ('6.7', COUNTS),
    'late by 0.1 s': ('6.8', COUNTS),
    'covariance zero': ('8.1', COUNTS),
    'covariance -1': ('8.1', COUNTS),
    'covariance constant': ('8.2', COUNTS),
    'rounding at each step': ('8.3', COUNTS),
    'slip ignored': ('8.4', COUNTS),
    'reset ignored': ('7.1', COUNTS),
    'keeps all messages': ('7.2', COUNTS),
}


def mapping_of(inputs, **changes):
    about = {'command': 'node', 'input': inputs, 'reset': '/reset', 'counter_bits': [8, 16, 32]}
    about.update({'sets_counter': True, 'sets_noise': True})
    return NodeMapping.from_mapping({**about, **changes}, 'mapping')


class VirtualTime:
    """In place of the module `time`: waiting takes no time, and each look at the clock 10 us."""

    def __init__(self, now_ns):
        self.now_ns = now_ns

    def time_ns(self):
        self.now_ns += 10_000
        return self.now_ns

    monotonic_ns = time_ns

    def monotonic(self):
        return 1e-9 * self.time_ns()

    def sleep(self, time_s):
        self.now_ns += round(1e9 * time_s)


class InProcess:
    """`Subject` that answers within `send`."""

    def __init__(self, mapping, wheels):
        self.mapping, self.wheels = mapping, wheels
        self.odometry, self.transforms, self.died = [], [], ''

    def publish(self, odometry, *transforms):
        late_ns = 10**8 if getattr(self, 'wrong', '') == 'late by 0.1 s' else 0
        self.odometry.append(Received(playing.time.monotonic_ns() + late_ns, odometry))
        self.transforms += [Received(playing.time.monotonic_ns(), transform) for transform in transforms]

    def wait(self, is_done, limit_s):
        end_s = playing.time.monotonic() + limit_s
        playing.time.sleep(0.0005)  # transport
        while not is_done() and playing.time.monotonic() < end_s:
            playing.time.sleep(0.01)
        return is_done()

    def fault(self):
        return self.died

    def memory_bytes(self):
        return 0


class OurOdometry(InProcess):
    """Encoder and odometry of this package."""

    def start(self, settings):
        wheels = {'ppr': self.wheels.ppr, 'counter_modulus': settings.modulus}
        geometry = {'wheel_diameter': self.wheels.wheel_diameter, 'wheel_separation': self.wheels.wheel_separation}
        noise = {'motion_noise': settings.motion_noise_m2_per_m}
        self.node = WheelOdometry(OdometryParams.from_mapping({**wheels, **geometry, **noise}, ''))
        self.encoder = ReportingEncoder(EncoderParams.from_mapping(wheels, ''))

    def send(self, sample):
        reports = [(sample.stamp_ns, *sample.counts.tolist())]
        if not self.mapping.reads_counts:
            try:
                reports = [each[:3] for each in self.encoder.update(sample.stamp_ns, JOINTS, sample.angles_rad)]
            except InputFault:
                reports = []
        for report in reports:
            estimate = self.node.update(*report)
            if estimate is not None:
                pose = estimate.base_pose_in_odom, estimate.stamp_ns
                self.publish(
                    encode_odometry(estimate, 'odom', 'base_link'), encode_planar_tf(*pose, 'odom', 'base_link')
                )

    def reset(self):
        self.node.reset()
        return True


class SimpleOdometry(InProcess):
    """Odometry as in a textbook, with at most one fault of FAULTS."""

    def __init__(self, mapping, wheels, fault=''):
        super().__init__(mapping, wheels)
        self.wrong = fault
        swapped = -1.0 if fault == 'left and right swapped' else 1.0
        self.m_per_count = wheels.m_per_count * (2.0 if fault == 'diameter as radius' else 1.0)
        self.turn_per_m = (
            swapped * (180.0 / math.pi if fault == 'degrees as radians' else 1.0) / wheels.wheel_separation
        )

    def start(self, settings):
        self.settings, self.died, self.sent, self.kept = settings, '', 0, []
        self.set_zero()
        self.counts = np.zeros(2, int) if self.wrong == 'first sample as motion' else None

    def set_zero(self):
        self.counts, self.stamp_ns, self.receipt_ns, self.old = None, 0, 0, None
        self.pose, self.noise = Pose2D(0.0, 0.0, 0.0), PlanarCovariance()

    def memory_bytes(self):
        return 10**7 + sum(map(len, self.kept))

    def reset(self):
        if self.wrong != 'reset ignored':
            self.set_zero()
        return True

    def send(self, sample):
        counts = sample.counts
        if not self.mapping.reads_counts:
            if np.isnan(sample.angles_rad).any():
                self.died = 'ended with status 1' if self.wrong == 'dies of NaN' else ''
                self.pose = Pose2D(math.nan, 0.0, 0.0) if self.wrong == 'NaN passes' else self.pose
                return
            rounded = np.trunc if self.wrong == 'truncates' else np.floor
            counts = rounded(sample.angles_rad * self.wheels.ppr / (2.0 * math.pi)).astype(int)
        if self.wrong == 'never answers':
            return
        self.sent += 1
        self.report(sample.stamp_ns, counts)

    def report(self, stamp_ns, counts):
        if stamp_ns < self.stamp_ns - 10**9:
            if self.wrong == 'silent after time goes back':
                return
            self.set_zero()
        if stamp_ns == self.stamp_ns:
            if self.wrong == 'repeats published again':
                self.answer(stamp_ns, 0.0, 0.0)
            return
        if stamp_ns < self.stamp_ns and self.wrong != 'late samples integrated':
            return
        interval_s, now_ns = (stamp_ns - self.stamp_ns) * 1e-9, playing.time.monotonic_ns()
        steps_m = np.zeros(2) if self.counts is None else self.steps_m(counts - self.counts, interval_s)
        if self.wrong == 'receipt time differences':
            interval_s = (now_ns - self.receipt_ns) * 1e-9
        is_burst = now_ns - self.receipt_ns < 3 * 10**5
        self.counts, self.stamp_ns, self.receipt_ns = counts, stamp_ns, now_ns
        distance_m, turn_rad = steps_m.mean(), (steps_m[1] - steps_m[0]) * self.turn_per_m
        is_lost = self.wrong == 'a burst discards counts' and is_burst
        self.move(steps_m, 0.0 if is_lost else distance_m, turn_rad)
        self.answer(stamp_ns, distance_m / interval_s, turn_rad / interval_s)

    def steps_m(self, steps, interval_s):
        modulus = self.settings.modulus
        if modulus and self.wrong != 'no wrap':
            steps = (steps + modulus // 2) % modulus - modulus // 2
        steps_m = steps * self.m_per_count
        if np.abs(steps_m).max() > 10.0 and self.wrong not in ('restart as motion', 'no wrap'):
            steps_m = np.zeros(2)
        if self.wrong == 'dies at speed' and np.abs(steps_m).max() > 1.1 * interval_s:
            self.died = 'ended with status 1'
        if interval_s > 0.6 and self.wrong == 'a gap discards counts':
            steps_m = np.zeros(2)
        return np.floor(1e3 * steps_m) / 1e3 if self.wrong == 'integer division' else steps_m

    def move(self, steps_m, distance_m, turn_rad):
        noise = self.settings.motion_noise_m2_per_m * (0.01 if self.wrong == 'slip ignored' else 1.0)
        self.noise = propagate_motion_noise(
            self.noise, self.pose.yaw_rad, *steps_m, self.wheels.wheel_separation, noise
        )
        if self.wrong == 'rounding at each step' and steps_m.any():
            rounding_m2 = self.wheels.m_per_count**2 / 12.0
            per_m = rounding_m2 / np.abs(steps_m).max()
            step = propagate_motion_noise(
                PlanarCovariance(), self.pose.yaw_rad, *steps_m, self.wheels.wheel_separation, per_m
            )
            self.noise = self.noise.plus(step)
        if self.wrong == 'Euler integration':
            self.pose = Pose2D(
                self.pose.x_m + distance_m * math.cos(self.pose.yaw_rad),
                self.pose.y_m + distance_m * math.sin(self.pose.yaw_rad),
                self.pose.yaw_rad + turn_rad,
            )
        else:
            self.pose = move_along_arc(self.pose, distance_m, turn_rad)

    def answer(self, stamp_ns, linear_mps, angular_radps):
        count_m2, lateral_mps = self.wheels.m_per_count**2, 0.0
        rounding_m2 = count_m2 / 12.0, count_m2 / 12.0
        covariance = self.noise.plus(quantisation_covariance(self.pose, rounding_m2, self.wheels.wheel_separation))
        small = PlanarCovariance(xx=0.003 * count_m2, yy=0.003 * count_m2)  # at pose zero the other one is singular
        covariance = covariance.plus(small)
        twist = TwistCovariance(count_m2, 0.0, count_m2)
        if self.wrong.startswith('covariance'):
            diagonal = {'zero': 0.0, '-1': -1.0, 'constant': 1e-3}[self.wrong.split()[1]]
            covariance = PlanarCovariance(xx=diagonal, yy=diagonal, yaw_yaw=diagonal)
        if self.wrong == 'twist in odom':
            turned = linear_mps * np.exp(1j * self.pose.yaw_rad)
            linear_mps, lateral_mps = turned.real, turned.imag
        if self.wrong == 'unsigned twist':
            linear_mps, angular_radps = abs(linear_mps), abs(angular_radps)
        stamp_ns = playing.time.time_ns() if self.wrong == 'stamp of now' else stamp_ns
        self.write(OdometryEstimate(stamp_ns, self.pose, linear_mps, angular_radps, covariance, twist, lateral_mps))

    def write(self, estimate):
        pose, stamp_ns = estimate.base_pose_in_odom, estimate.stamp_ns
        frame = '/odom' if self.wrong == 'leading slash' else 'odom'
        child = 'base_footprint' if self.wrong == 'wrong child frame' else 'base_link'
        odometry = encode_odometry(estimate, frame, child)
        pose = pose.inverse() if self.wrong == 'transform inverted' else pose
        transform = encode_planar_tf(pose, stamp_ns, frame, 'base_link')
        if self.wrong == 'quaternion not normalised':
            odometry = scaled_quaternion(odometry)
        if self.wrong == 'every third sample' and self.sent % 3 != 1:
            return
        if self.wrong == 'every message twice, every other not':
            odometry, self.old = self.old or odometry, None if self.old else odometry
        self.kept += [odometry] if self.wrong == 'keeps all messages' else []
        transforms = [transform] * {'transform twice': 2, 'no transform': 0}.get(self.wrong, 1)
        for _ in range(10 if self.wrong == 'ten times' else 1):
            self.publish(odometry, *transforms)


class SlowConnection(SimpleOdometry):
    """Its messages arrive one after the other, while the suite waits."""

    def __init__(self, mapping, wheels, fault=''):
        super().__init__(mapping, wheels, fault)
        self.pending = deque()

    def publish(self, odometry, *transforms):
        self.pending.append((odometry, *transforms))

    def wait(self, is_done, limit_s):
        end_s = playing.time.monotonic() + limit_s
        while not is_done() and playing.time.monotonic() < end_s:
            playing.time.sleep(0.0002 if self.pending else 0.01)
            if self.pending:
                super().publish(*self.pending.popleft())
        return is_done()


def scaled_quaternion(odometry):
    """A serialized nav_msgs/Odometry with its quaternion 1.2 times as long."""
    at = len(odometry) - 8 * (85 - 3)
    quaternion = 1.2 * np.frombuffer(odometry[at : at + 32])
    return odometry[:at] + quaternion.tobytes() + odometry[at + 32 :]


def evidence_of(subject, inputs=COUNTS, wheels=None, rounds=None, now_ns=1_700_000_000_000_000_000, **changes):
    """Play all cases, or some rounds, to a node, a class or function of mapping and wheels, in virtual time."""
    mapping, wheels = mapping_of(inputs, **changes), wheels or Wheels()
    with mock.patch.object(playing, 'time', VirtualTime(now_ns)):
        player = Player(subject(mapping, wheels), mapping, wheels)
        recordings, unusable = play_all(rounds or plan(mapping, wheels), player)
    return Evidence(mapping, wheels, recordings, unusable)
