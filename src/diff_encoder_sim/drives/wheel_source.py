"""Interface of the sources of wheel angles, and what they share: units of recorded numbers, and pairs of both wheels.

A source takes the messages of its topics one after the other, keeps two numbers and two times of each, and converts
them to a `Drive` at the end. They are in joint_wheels, field_wheels, odometry_wheels and csv_wheels.
"""

from __future__ import annotations

import math
from array import array
from typing import Collection, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from typing_extensions import Protocol

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.drives.number_units import RAD_OF_ANGLE, RADPS_OF_SPEED, SPEEDS, TICKS
from diff_encoder_sim.drives.ros1_stream import Message
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.report_link import LATE_REPORT_TOLERANCE_NS

DEFAULT_SEED = 1

# Across a longer gap it is not known how a wheel has turned.
LONGEST_GAP_NS = NANOSECONDS_PER_SECOND


class DriveStream(Protocol):
    """A drive as it was recorded: a bag (`open_source`), or a CSV file."""

    is_cdr: bool
    topics: Dict[str, str]  # types by topic

    @property
    def fault(self) -> str:
        """Return why not all of it can be read."""

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics in the order of their recording; may be called several times."""


class TimedDrive(NamedTuple):
    """A drive, and the recorder's clock at each of its samples [ns] (n,)."""

    drive: Drive
    times_ns: np.ndarray


class WheelSource(Protocol):
    """Takes the messages of some topics, and converts them to wheel angles."""

    topics: Tuple[str, ...]
    joints: Tuple[str, str]  # left, right: the names under which angles are given
    ppr: Optional[PerWheel]  # of the encoder that counted; None if it is not known
    are_joint_angles: bool  # of joints, which may turn backward when the robot drives forward
    text: str  # what it reads, after a number of messages

    def add(self, message: Message) -> None:
        """Add a message of `topics`.

        Raises:
            InputFault: the message cannot be used.
        """

    def drives(self) -> List[TimedDrive]:
        """Return the drive up to now; several if the stamps go back, as after a reset of the simulator."""

    def notes(self) -> Iterator[str]:
        """List what must be known of the angles, one line each, after `drives`."""


class WheelNumbers:
    """The recorded numbers of one wheel, with their stamps and the times of their recording."""

    def __init__(self) -> None:
        self._stamps_ns, self._times_ns, self._values = array('q'), array('q'), array('d')

    def add(self, stamp_ns: int, time_ns: int, value: float) -> None:
        """Add the next number."""
        self._stamps_ns.append(stamp_ns)
        self._times_ns.append(time_ns)
        self._values.append(value)

    def series(self) -> WheelSeries:
        """Return all numbers as arrays."""
        return WheelSeries(*(np.array(column) for column in (self._stamps_ns, self._times_ns, self._values)))


class WheelSeries(NamedTuple):
    """Numbers or angles of one wheel, in the order of their recording."""

    stamps_ns: np.ndarray  # (n,) int64
    times_ns: np.ndarray  # (n,) int64
    values: np.ndarray  # (n,) in their unit, or [rad]

    def at(self, rows: np.ndarray) -> WheelSeries:
        """Return some rows."""
        return WheelSeries(self.stamps_ns[rows], self.times_ns[rows], self.values[rows])


def ascending_runs(stamps_ns: np.ndarray, tolerance_ns: int = LATE_REPORT_TOLERANCE_NS) -> List[np.ndarray]:
    """Return the rows of ascending stamps: several arrays if time was set back by more than the tolerance.

    Rows whose stamp repeats or that others have overtaken are left out.
    """
    if (np.diff(stamps_ns) > 0).all():
        return [np.arange(len(stamps_ns))]
    timeline = Timeline(tolerance_ns)
    runs: List[List[int]] = [[]]
    for row, stamp_ns in enumerate(stamps_ns.tolist()):
        step = timeline.advance(stamp_ns)
        if step is Step.RESTART:
            runs.append([])
        if step is not Step.STALE:
            runs[-1].append(row)
    return [np.array(rows) for rows in runs]


def paired_drives(left: WheelSeries, right: WheelSeries) -> Tuple[List[TimedDrive], int]:
    """Return both wheels at the stamps of the left one, the right one interpolated between the two around it.

    Args:
        left: angles of the left wheel [rad].
        right: angles of the right wheel [rad].

    Returns:
        the drives, and how many angles of the left wheel have none of the right one within `LONGEST_GAP_NS`, those
        before the first pair not counted.
    """
    if np.array_equal(left.stamps_ns, right.stamps_ns):
        runs = [(left.at(rows), right.values[rows]) for rows in ascending_runs(left.stamps_ns)]
        return [_timed_drive(of_left, right_rad) for of_left, right_rad in runs], 0
    drives, left_out = [], 0
    lefts, rights = ([side.at(rows) for rows in ascending_runs(side.stamps_ns)] for side in (left, right))
    for of_left, of_right in zip(lefts, rights):
        if not (len(of_left.stamps_ns) and len(of_right.stamps_ns)):
            continue
        after = np.searchsorted(of_right.stamps_ns, of_left.stamps_ns).clip(max=len(of_right.stamps_ns) - 1)
        before = np.where(of_right.stamps_ns[after] == of_left.stamps_ns, after, (after - 1).clip(min=0))
        before_ns, after_ns = of_right.stamps_ns[before], of_right.stamps_ns[after]
        is_between = (before_ns <= of_left.stamps_ns) & (of_left.stamps_ns <= after_ns)
        is_paired = is_between & (after_ns - before_ns <= LONGEST_GAP_NS)
        right_rad = np.interp(of_left.stamps_ns, of_right.stamps_ns, of_right.values)
        drives.append(_timed_drive(of_left.at(is_paired), right_rad[is_paired]))
        # The last left angles wait for a right one only.
        is_missed = (np.cumsum(is_paired) > 0) & ~is_paired
        left_out += int(np.count_nonzero(is_missed & (of_left.stamps_ns < of_left.stamps_ns[-1] - LONGEST_GAP_NS)))
    return drives, left_out


def _timed_drive(left: WheelSeries, right_rad: np.ndarray) -> TimedDrive:
    return TimedDrive(Drive(left.stamps_ns, np.column_stack((left.values, right_rad))), left.times_ns)


def start_angles_rad(seed: int) -> Tuple[float, float]:
    """Draw the angles of the left and the right wheel at the start, each anywhere in a turn.

    If both were 0, the encoders would step together: on a straight drive their errors would cancel.
    """
    left_rad, right_rad = generator(seed, 'wheel_phase').uniform(0.0, 2.0 * math.pi, 2).tolist()
    return left_rad, right_rad


def start_angles_note(seed: int) -> str:
    """Describe the source of the angles at the start."""
    return (
        f'where the wheels stood at the start is not known: drawn by --seed {seed}; with another seed, each encoder '
        f'rounds elsewhere, and its path ends elsewhere'
    )


SPEEDS_NOTE = (
    'the wheel angles are integrated speeds: what a wheel does between two of them, and the error of each, adds up in '
    'them; a PPR adds its own rounding'
)


class WheelUnit(NamedTuple):
    """How the numbers of one wheel are to be understood."""

    unit: str  # one of UNITS
    radius_m: float
    ppr: Optional[float] = None  # of counts
    counter_modulus: int = 0  # of counts; 0 if they do not wrap
    is_reversed: bool = False  # they fall when the robot drives forward
    start_rad: float = 0.0  # angle at the first speed


def angles_of_counts_rad(counts: np.ndarray, ppr: float) -> np.ndarray:
    """Return the middles of the pulses that a wheel is in.

    At a PPR that divides this encoder's, equation (1) then gives the very counts. At another PPR,
    a count is one off in a quarter of PPR / this encoder's PPR of the samples.
    """
    return np.asarray((counts + 0.5) * (2.0 * math.pi / ppr))


def wheel_angles(numbers: WheelSeries, unit: WheelUnit) -> WheelSeries:
    """Convert the numbers of a wheel to its angles [rad].

    Counts are unwrapped, speeds integrated by the trapezoidal rule; time that goes back does not turn a wheel.
    """
    values = numbers.values
    if unit.ppr is not None:
        counts = np.floor(values if unit.unit == TICKS else np.cumsum(values)).astype(np.int64)
        if unit.counter_modulus:
            half = unit.counter_modulus // 2
            steps = (np.diff(counts) + half) % unit.counter_modulus - half
            counts = np.cumsum(np.concatenate((counts[:1], steps)))
        angles_rad = angles_of_counts_rad(counts, unit.ppr)
    elif unit.unit in SPEEDS:
        speeds_radps = RADPS_OF_SPEED[unit.unit](unit.radius_m) * values
        intervals_s = np.maximum(np.diff(numbers.stamps_ns), 0) / NANOSECONDS_PER_SECOND
        turns_rad = 0.5 * (speeds_radps[1:] + speeds_radps[:-1]) * intervals_s
        angles_rad = np.cumsum(np.concatenate(([unit.start_rad], turns_rad)))[: len(values)]
    else:
        angles_rad = RAD_OF_ANGLE[unit.unit](unit.radius_m) * values
    return numbers._replace(values=-angles_rad if unit.is_reversed else angles_rad)


def receive_times_note(times_ns: Mapping[str, Sequence[int]]) -> str:
    """Describe the stamps of topics whose messages have none, by the times at which they were received [ns]."""
    texts = []
    for topic, of_topic in times_ns.items():
        intervals_ns = np.diff(np.asarray(of_topic)) if len(of_topic) > 1 else np.zeros(1)
        texts.append(f'{topic} every {1e-6 * intervals_ns.mean():.1f} ms +- {1e-6 * intervals_ns.std():.1f} ms')
    return (
        f'no stamps: the times of receipt are used, of {" and ".join(texts)} (mean, standard '
        f'deviation); this jitter is in speeds and comparisons, not in the counts'
    )
