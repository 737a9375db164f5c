"""Judges the odometry of a recorded drive by the clauses that it can show."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Iterator, List, NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.api.options import ConformanceOptions
from diff_encoder_sim.api.recorded_sources import RECORDED_PPR, OpenedDrive, forward_drives, open_drive
from diff_encoder_sim.api.wheel_options import check_wheel_options
from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.conformance import report
from diff_encoder_sim.conformance.cases import Case
from diff_encoder_sim.conformance.clauses import Evidence
from diff_encoder_sim.conformance.mapping import ANGLES, COUNTS, NodeMapping, Wheels
from diff_encoder_sim.conformance.recording import FramedPose, Recording, Sample, decode_odometry, decode_transforms
from diff_encoder_sim.conformance.verdicts import FAIL, Verdict, judge
from diff_encoder_sim.drives.reencoding import read_drive
from diff_encoder_sim.drives.topics import ODOMETRY_TYPE, TF

SEGMENT_S = 5.0  # the longer, the less an error is blamed on the motion that caused it
FEWEST = 5  # messages in a segment


class JudgedDrive(NamedTuple):
    """Verdicts on the odometry of a drive."""

    evidence: Evidence
    verdicts: List[Verdict]
    text: str
    files: List[Path]

    @property
    def has_failed(self) -> bool:
        """Return whether a clause fails."""
        return any(verdict.outcome == FAIL for verdict in self.verdicts)


def judge_drive(options: ConformanceOptions) -> JudgedDrive:
    """Compare odometry with exact arcs of the recorded wheels; ConfigError for invalid options and unusable bags."""
    begin_s, wheels_only = time.monotonic(), replace(options, odom='')
    check_wheel_options(wheels_only, options.bag, None)
    opened = open_drive(wheels_only, options.bag, is_table=False)
    source, robot = opened.source, opened.robot.odometry
    if source.topics.get(options.odom) != ODOMETRY_TYPE:
        found = source.topics.get(options.odom, 'not there')
        raise ConfigError(f'{options.bag}: --odom: given {options.odom}, which is {found}; allowed: {ODOMETRY_TYPE}')
    if opened.robot.is_guessed() and not (options.wheel_diameter and options.wheel_separation):
        raise ConfigError('--wheel-diameter, --wheel-separation: missing; expected both, or --robot')
    diameters_m = [options.wheel_diameter or each for each in (robot.wheel_diameter.left, robot.wheel_diameter.right)]
    of_node = opened.robot.encoder.ppr.left if 'ppr' in opened.robot.sources or opened.trial else RECORDED_PPR
    ppr = opened.wheels.ppr.left if opened.wheels.ppr else of_node
    separation_m = options.wheel_separation or robot.wheel_separation
    wheels = Wheels(ppr=ppr, wheel_diameter=sum(diameters_m) / 2, wheel_separation=separation_m)
    odometry, transforms = _published(opened, options.odom)
    read = read_drive(source, opened.wheels, None)
    recordings: List[Recording] = []
    for timed, drive in zip(read.drives, forward_drives(read, opened.wheels, opened.robot)):
        is_received = np.array_equal(timed.times_ns, drive.stamps_ns)  # numbers without stamps
        rounding_m = 0.0 if opened.wheels.ppr else wheels.m_per_count  # of the node, which counts the recorded angles
        times_ns = np.array([each.receipt_ns if is_received else each.stamp_ns for each in odometry])
        for part in _segments(drive, 0.5 * np.array(diameters_m), separation_m, odometry, times_ns):
            within = [each for each in transforms if part.sent_ns[0] <= each.stamp_ns <= part.sent_ns[-1]]
            recordings.append(part._replace(transforms=within, slack_m=part.slack_m + rounding_m))
    if not recordings:
        raise ConfigError(f'{options.bag}: {options.odom} and {opened.wheels.text}: no stamps in common')
    first = odometry[0]
    mapping = NodeMapping(
        about=f'{options.odom} of {options.bag.name}',
        input=dict(zip(('left', 'right'), COUNTS if opened.wheels.ppr else ANGLES)),
        encoder=False,
        odom_frame=options.odom_frame or first.frame.lstrip('/') or 'odom',
        base_frame=options.base_frame or first.child_frame.lstrip('/') or 'base_link',
        publish_tf=any((each.frame, each.child_frame) == (first.frame, first.child_frame) for each in transforms),
    )
    wheel_ns = np.concatenate([timed.drive.stamps_ns for timed in read.drives])
    is_stamped = bool(np.isin([message.stamp_ns for message in odometry], wheel_ns).mean() > 0.5)  # by the samples
    evidence = Evidence(mapping, wheels, recordings, '', is_stamped, 'a recorded drive does not show it')
    verdicts, files = judge(evidence), []
    if options.out:
        from diff_encoder_sim.conformance.conformance_page import write_page  # noqa: PLC0415 - Altair takes a second

        options.out.mkdir(parents=True, exist_ok=True)
        files = [options.out / 'conformance.html', options.out / 'conformance.xml']
        write_page(evidence, verdicts, 'conformance', files[0])
        write_file(files[1], report.junit_xml(verdicts, options.bag.name, time.monotonic() - begin_s))
    return JudgedDrive(evidence, verdicts, report.verdict_table(verdicts), files)


def _published(opened: OpenedDrive, odom: str) -> Tuple[List[FramedPose], List[FramedPose]]:
    """Return odometry, and the transforms of its child frame; ConfigError without odometry."""
    odometry: List[FramedPose] = []
    transforms: List[FramedPose] = []
    for message in opened.source.messages((odom, TF)):
        try:
            decoded = message.raw, message.time_ns, opened.source.is_cdr
            if message.topic == odom:
                odometry.append(decode_odometry(*decoded))
            else:
                transforms += decode_transforms(*decoded)
        except InputFault:
            continue
    if not odometry:
        raise ConfigError(f'{opened.source.path}: {odom}: no readable message')
    child = odometry[0].child_frame.lstrip('/')
    return odometry, [each for each in transforms if each.child_frame.lstrip('/') == child]


def _segments(
    drive: Drive, radii_m: np.ndarray, separation_m: float, odometry: List[FramedPose], times_ns: np.ndarray
) -> Iterator[Recording]:
    """Yield the parts of a drive, from one message of odometry to another, with the travels of the wheels between.

    `times_ns` (n,) of the odometry are by the clock of the drive. The recordings have no transforms yet.
    """
    stamps_ns, travels_m = drive.stamps_ns, drive.wheel_angles_rad * radii_m
    inside = np.flatnonzero((times_ns >= stamps_ns[0]) & (times_ns <= stamps_ns[-1])) if len(drive) else np.array([])
    if not len(inside):
        return
    parts = (times_ns[inside] - times_ns[inside[0]]) // round(SEGMENT_S * NANOSECONDS_PER_SECOND)

    def travels_at(at_ns: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(at_ns, stamps_ns, column) for column in travels_m.T])

    for part in np.unique(parts):
        rows = inside[parts == part]
        rows = np.append(rows[0] - 1, rows) if rows[0] > inside[0] else rows
        if len(rows) < FEWEST:
            continue
        at_ns = times_ns[rows]
        between = (stamps_ns > at_ns[0]) & (stamps_ns < at_ns[-1])
        path_ns = np.concatenate((at_ns[:1], stamps_ns[between], at_ns[-1:]))
        path_m = travels_at(path_ns)
        samples = [Sample(stamp, np.zeros(2), np.zeros(2), np.zeros(2)) for stamp in path_ns.tolist()]
        # Odometry between two samples has the counts of the first one.
        slack_m = 0.0 if np.isin(at_ns, stamps_ns).all() else float(abs(np.diff(path_m, axis=0)).max())
        case = Case(f'{1e-9 * (at_ns[0] - stamps_ns[0]):.0f} s', 1e-9 * (path_ns - at_ns[0]), path_m, is_motion=True)
        published = [odometry[row] for row in rows]
        quarter = len(published) // 4
        ends_ns = at_ns[[quarter, len(at_ns) - quarter - 1]]
        left_mps, right_mps = np.diff(travels_at(ends_ns), axis=0)[0] / np.diff(1e-9 * ends_ns)
        twist = 0.5 * (left_mps + right_mps), (right_mps - left_mps) / separation_m
        sent_ns, (start, *after) = path_ns.tolist(), published
        yield Recording(case, samples, sent_ns, path_m, start, after, transforms=[], slack_m=slack_m, twist=twist)
