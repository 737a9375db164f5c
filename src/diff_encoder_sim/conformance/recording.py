"""What a node answers to a case: its odometry and transforms, decoded as they are, right or wrong."""

from __future__ import annotations

import struct
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.conformance.cases import Case
from diff_encoder_sim.conformance.mapping import QUANTITIES, Wheels
from diff_encoder_sim.conformance.reference import exact_path, relative_pose
from diff_encoder_sim.drives.message_decoders import NUMBER_SIZE, FieldReader

_ODOMETRY, _TRANSFORM = struct.Struct('<85d'), struct.Struct('<7d')
_PLANAR = np.ix_((0, 1, 5), (0, 1, 5))  # x, y, yaw


class Sample(NamedTuple):
    """Input of a node at a stamp."""

    stamp_ns: int
    angles_rad: np.ndarray  # (2,) left, right
    counts: np.ndarray  # (2,) as the counter shows them
    speeds_mps: np.ndarray  # (2,) of the rims since the sample before

    def quantities(self, wheels: Wheels) -> Dict[str, float]:
        """Return the values of mapping.QUANTITIES."""
        left_mps, right_mps = self.speeds_mps.tolist()
        radps = (2.0 * self.speeds_mps / wheels.wheel_diameter).tolist()
        robot = 0.5 * (left_mps + right_mps), (right_mps - left_mps) / wheels.wheel_separation
        return dict(zip(QUANTITIES, (*self.counts.tolist(), *self.angles_rad.tolist(), *radps, *robot)))


class FramedPose(NamedTuple):
    """Pose of a child frame, and the numbers after it, as published."""

    receipt_ns: int  # by the clock of the receiver
    stamp_ns: int
    frame: str
    child_frame: str
    numbers: np.ndarray  # position (3), quaternion x y z w (4), and of odometry: covariance (36), twist (6), its (36)

    @property
    def pose(self) -> np.ndarray:
        """Return (3,) x [m], y [m] and yaw [rad]; of a quaternion of any length."""
        x, y, z, w = self.numbers[3:7]
        yaw_rad = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
        return np.array([*self.numbers[:2], yaw_rad])

    @property
    def covariance(self) -> np.ndarray:
        """Return the (3, 3) covariance of x, y and yaw."""
        return np.asarray(self.numbers[7:43].reshape(6, 6)[_PLANAR])

    @property
    def twist(self) -> np.ndarray:
        """Return (3,) linear x and y [m/s], and angular z [rad/s]."""
        return self.numbers[[43, 44, 48]]

    @property
    def twist_covariance(self) -> np.ndarray:
        """Return the (2, 2) covariance of linear x and angular z."""
        return np.asarray(self.numbers[49:].reshape(6, 6)[np.ix_((0, 5), (0, 5))])


def decode_odometry(raw: bytes, receipt_ns: int = 0, is_cdr: bool = False) -> FramedPose:
    """Decode a nav_msgs/Odometry; InputFault if it is torn."""
    fields = FieldReader(raw, is_cdr)
    stamp_ns, frame = fields.header()
    child = fields.text()
    return FramedPose(receipt_ns, stamp_ns, frame, child, np.array(fields.unpack(_ODOMETRY, NUMBER_SIZE)))


def decode_transforms(raw: bytes, receipt_ns: int = 0, is_cdr: bool = False) -> List[FramedPose]:
    """Decode a tf2_msgs/TFMessage; InputFault if it is torn."""
    fields, found = FieldReader(raw, is_cdr), []
    for _ in range(fields.length()):
        stamp_ns, frame = fields.header()
        child = fields.text()
        found.append(FramedPose(receipt_ns, stamp_ns, frame, child, np.array(fields.unpack(_TRANSFORM, NUMBER_SIZE))))
    return found


class Recording(NamedTuple):
    """A case, or a part of a recorded drive, and all that was published meanwhile."""

    case: Case
    samples: List[Sample]  # in the order of sending
    sent_ns: List[int]  # by the clock of the receiver
    travels_m: np.ndarray  # (n, 2) of the wheels by the counts that the node can use, in the order of time
    start: Optional[FramedPose]  # odometry before the case, or after its reset
    odometry: List[FramedPose]
    transforms: List[FramedPose]  # of the odometry's frames, and others with its child
    fault: str = ''  # the node died, or did not answer in time
    memory_bytes: int = 0  # of the node at the end; 0 if unknown
    slack_m: float = 0.0  # travel of a wheel between two samples, if odometry has other stamps
    twist: Tuple[float, float] = (0.0, 0.0)  # true mean in the middle of a recorded drive [m/s, rad/s]

    @property
    def is_broken(self) -> bool:
        """Return whether the node cannot be used after it."""
        return bool(self.fault) or not (self.odometry and np.isfinite(self.odometry[-1].numbers[:7]).all())

    @property
    def has_ended(self) -> bool:
        """Return whether the node has not survived, or not answered, an orderly case: only clause 1.2 judges that."""
        return self.case.is_orderly and bool(self.fault or not self.odometry)

    @property
    def name(self) -> str:
        """Return the name of the case."""
        return self.case.name

    def expected(self, separation_m: float) -> np.ndarray:
        """Return (n, 3) the exact path, from pose zero."""
        return exact_path(self.travels_m, separation_m)

    def found(self) -> np.ndarray:
        """Return (m, 3) the poses of the odometry relative to the start."""
        start = self.start or self.odometry[0]
        return np.array([relative_pose(start.pose, message.pose) for message in self.odometry])
