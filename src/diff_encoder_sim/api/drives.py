"""Recorded drives."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from diff_encoder_sim.api.command_options import command_line, parsed
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries
from diff_encoder_sim.cli.reencode import notes_on, opened_drive, run_drive, wheels_with
from diff_encoder_sim.cli.reencode_arguments import parse
from diff_encoder_sim.cli.reencode_encoders import chosen_encoders, given_encoders
from diff_encoder_sim.cli.reencode_outputs import output_files
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.reference import find_reference
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.trajectory_error import PathError
from diff_encoder_sim.drives.wheels_at_ppr import WheelsAtPpr
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

log = logging.getLogger(__name__)


class ReencodedDrive(NamedTuple):
    """A recorded drive as an encoder would have seen it."""

    ppr: str  # label of the encoder
    odometry: PoseSeries  # base in odom
    error: Optional[PathError]  # against the reference; None where no stamps are common


def reencode(bag: Union[str, Path, None] = None, **options: Any) -> List[ReencodedDrive]:
    """Compute what a recorded drive would have been with other encoders, one result for each.

    Args:
        bag: of ROS 1 or ROS 2; None where the option csv names a table.
        options: of the command `reencode`: ppr, encoder, out, robot, reference, ...

    Raises:
        ConfigError: an option or a file is bad, or there is no drive in it.
        OSError: a file cannot be written.
    """
    given = parsed(parse, [*([str(bag)] if bag is not None else []), *command_line(options)])
    with opened_drive(given) as drive:
        encoders = chosen_encoders(given_encoders(given), drive.robot.encoder)
        runs = [wheels_with(encoder, drive.robot, _WheelsWithPath) for encoder in encoders]
        summary = run_drive(drive, runs, output_files(given.out, drive.path, encoders))
        for note in notes_on(drive, runs, summary):
            log.warning('%s: %s', drive.path, note)
    return [ReencodedDrive(run.label, _series(run.path), run.comparison.result()) for run in runs]


def read_path(bag: Union[str, Path], reference: str = '/odom') -> PoseSeries:
    """Read the poses of a topic, such as /odom or /world_pose, or of a frame in another, as 'map->base_link'.

    Raises:
        ConfigError: the bag cannot be read, or has no such poses.
        InputFault: a message is torn.
    """
    path = Path(bag)
    with open_source(path) as source:
        poses = find_reference(path, source, reference)
        found = [pose for message in source.messages(poses.topics) for pose in poses.poses(message)] if poses else []
    if not found:
        raise ConfigError(f'{path}: no poses of {reference}')
    return _series([(pose.stamp_ns, pose.pose) for pose in found])


class _WheelsWithPath(WheelsAtPpr):
    """Keeps the whole path."""

    def __init__(self, ppr: PerWheel, encoder: EncoderParams, odometry: OdometryParams, name: str = '') -> None:
        super().__init__(ppr, encoder, odometry, name)
        self.path: List[Tuple[int, Pose2D]] = []

    def update(self, time_ns: int, joints: JointValues) -> bool:
        """Take a joint message, as `WheelsAtPpr` does."""
        has_moved = super().update(time_ns, joints)
        if has_moved:
            self.path.append(self.stamped_pose)
        return has_moved


def _series(path: Sequence[Tuple[int, Pose2D]]) -> PoseSeries:
    stamps_ns = np.array([stamp_ns for stamp_ns, _ in path], dtype=np.int64)
    return PoseSeries(stamps_ns, np.array([(pose.x_m, pose.y_m, pose.yaw_rad) for _, pose in path]).reshape(-1, 3))
