"""Odometry nodes without ROS, for the conformance suite: this package's odometry, right or with one fault."""

import time

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.conformance.cases import plan
from diff_encoder_sim.conformance.clauses import Evidence
from diff_encoder_sim.conformance.mapping import NodeMapping, Wheels
from diff_encoder_sim.conformance.playing import Player, Received, play_all
from diff_encoder_sim.drives.message_encoders import encode_odometry, encode_planar_tf
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder

JOINTS = {'/joint_states.position[0]': 'left_rad', '/joint_states.position[1]': 'right_rad'}
COUNTS = {'/encoder_pulse.pulses[0]': 'left_count', '/encoder_pulse.pulses[1]': 'right_count'}
FRAMES = 'odom', 'base_link'


def mapping_of(inputs, **changes):
    about = {'input': inputs, 'reset': '/reset', 'counter_bits': [8, 16, 32], 'sets_counter': True, 'sets_noise': True}
    return NodeMapping.from_mapping({**about, **changes}, 'mapping')


class OurOdometry:
    """`Subject` of this package's encoder and odometry, which answers within `send`."""

    def __init__(self, mapping, wheels):
        self.mapping, self.wheels = mapping, wheels
        self.odometry, self.transforms = [], []

    def start(self, settings):
        wheels = {'ppr': self.wheels.ppr, 'counter_modulus': settings.modulus}
        geometry = {'wheel_diameter': self.wheels.wheel_diameter, 'wheel_separation': self.wheels.wheel_separation}
        noise = {'motion_noise': settings.motion_noise_m2_per_m}
        params = OdometryParams.from_mapping({**wheels, **geometry, **noise}, '')
        self.node = WheelOdometry(params)
        self.encoder = ReportingEncoder(EncoderParams.from_mapping(wheels, ''))

    def send(self, sample):
        if self.mapping.reads_counts:
            reports = [(sample.stamp_ns, *sample.counts.tolist())]
        else:
            try:
                joints = ('left_wheel_joint', 'right_wheel_joint')
                reports = [each[:3] for each in self.encoder.update(sample.stamp_ns, joints, sample.angles_rad)]
            except InputFault:
                reports = []
        for report in reports:
            estimate = self.node.update(*report)
            if estimate is not None:
                self.publish(estimate)

    def publish(self, estimate):
        receipt_ns = time.monotonic_ns()
        transform = encode_planar_tf(estimate.base_pose_in_odom, estimate.stamp_ns, *FRAMES)
        self.transforms.append(Received(receipt_ns, transform))
        self.odometry.append(Received(receipt_ns, encode_odometry(estimate, *FRAMES)))

    def wait(self, is_done, limit_s):
        while not is_done() and limit_s > 0.0:
            time.sleep(0.01)
            limit_s -= 0.01
        return is_done()

    def reset(self):
        self.node.reset()
        return True

    def fault(self):
        return ''

    def memory_bytes(self):
        return 0


def evidence_of(subject_class, inputs=COUNTS, wheels=None, **changes):
    """Play all cases to a node."""
    mapping, wheels = mapping_of(inputs, **changes), wheels or Wheels()
    recordings, unusable = play_all(plan(mapping, wheels), Player(subject_class(mapping, wheels), mapping, wheels))
    return Evidence(mapping, wheels, recordings, unusable)
