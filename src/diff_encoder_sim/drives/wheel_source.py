"""The base class of the sources of wheel angles: units of recorded numbers, and pairs of both wheels."""

from __future__ import annotations

import math
from array import array
from typing import Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.drives.drive_stream import Message
from diff_encoder_sim.drives.number_units import RAD_OF_ANGLE, RADPS_OF_SPEED, TICKS
from diff_encoder_sim.wheels.encoder_params import ppr_label
from diff_encoder_sim.wheels.report_link import LATE_REPORT_TOLERANCE_NS

SIDES = ('left', 'right')

LONGEST_GAP_NS = NANOSECONDS_PER_SECOND  # across a longer one, the rotation of a wheel is unknown
FEWEST_COUNTS, FEWEST_ROWS = 100, 20  # in which a wrap is told from a short drive


class TimedDrive(NamedTuple):
    """A drive, and the recorder's clock at each of its samples [ns] (n,)."""

    drive: Drive
    times_ns: np.ndarray


class WheelSeries(NamedTuple):
    """Numbers or angles of one wheel, in the order of their recording."""

    stamps_ns: np.ndarray  # (n,) int64
    times_ns: np.ndarray  # (n,) int64
    values: np.ndarray  # (n,) in their unit, or [rad]

    def at(self, rows: np.ndarray) -> WheelSeries:
        """Return some rows."""
        return WheelSeries(*(column[rows] for column in self))


class WheelNumbers(NamedTuple):
    """Interpretation of the recorded numbers of both wheels."""

    unit: str  # one of UNITS
    radii_m: Tuple[float, float]  # of the left and the right wheel
    ppr: Optional[PerWheel] = None  # of counts
    moduli: Tuple[int, int] = (0, 0)  # of the left and the right counter; 0 if it does not wrap
    reversed_sides: Sequence[str] = ()  # whose numbers fall when the robot drives forward
    may_wrap: bool = False  # where is unknown

    @property
    def text(self) -> str:
        """Describe the numbers."""
        counted = [f'{ppr_label(self.ppr)} a revolution'] if self.ppr else []
        wraps = [f'the counter wraps at {" and ".join(map(str, sorted(set(self.moduli))))}'] if any(self.moduli) else []
        return ', '.join([self.unit, *counted, *wraps, *(f'{side} reversed' for side in self.reversed_sides)])

    def notes(self) -> Iterator[str]:
        """List limits of the angles, one line each."""
        if self.unit in RADPS_OF_SPEED:
            yield 'the wheel angles are integrated speeds, whose errors add up; each encoder adds its own rounding'

    def wrap_fault(self, side: int, angles: WheelSeries) -> str:
        """Return the wrap of a counter of unknown width: a step over half of all its counts; empty if it has none."""
        if not self.may_wrap or len(angles.values) < FEWEST_ROWS:
            return ''
        counts = angles.values * (getattr(self.ppr, SIDES[side]) / (2.0 * math.pi))
        steps, intervals_ns = np.diff(counts), np.diff(angles.stamps_ns)
        wraps = np.flatnonzero((abs(steps) > 0.5 * np.ptp(counts)) & (intervals_ns <= LONGEST_GAP_NS))
        if np.ptp(counts) < FEWEST_COUNTS or not len(wraps):
            return ''
        seconds = (angles.stamps_ns[wraps[0]] - angles.stamps_ns[0]) / NANOSECONDS_PER_SECOND
        return (
            f'given a {SIDES[side]} wheel whose counts step by {steps[wraps[0]]:.0f} at {seconds:.2f} s; '
            'allowed: --ticks-modulus, if its counter wraps, 0 if it does not'
        )

    def angles(self, side: int, numbers: WheelSeries) -> WheelSeries:
        """Convert the numbers of the left (0) or right (1) wheel to its angles [rad].

        Counts are unwrapped, speeds integrated by the trapezoidal rule; time that goes back does not turn a wheel.
        """
        values, per_radius = numbers.values, 1.0 / self.radii_m[side] if self.unit.startswith('m') else 1.0
        if self.ppr is not None:
            counts = np.floor(values if self.unit == TICKS else np.cumsum(values)).astype(np.int64)
            if self.moduli[side]:
                half = self.moduli[side] // 2
                counts[1:] = counts[:1] + np.cumsum((np.diff(counts) + half) % self.moduli[side] - half)
            # The middles of the pulses: at a PPR that divides this encoder's, equation (1) gives the same counts. At
            # another PPR, a count is one off in a quarter of PPR / this encoder's PPR of the samples.
            angles_rad = (counts + 0.5) * (2.0 * math.pi / getattr(self.ppr, SIDES[side]))
        elif self.unit in RADPS_OF_SPEED:
            speeds_radps = RADPS_OF_SPEED[self.unit] * per_radius * values
            intervals_s = np.maximum(np.diff(numbers.stamps_ns), 0) / NANOSECONDS_PER_SECOND
            turns_rad = 0.5 * (speeds_radps[1:] + speeds_radps[:-1]) * intervals_s
            angles_rad = np.concatenate(([0.0], turns_rad)).cumsum()[: len(values)]
        else:
            angles_rad = RAD_OF_ANGLE[self.unit] * per_radius * values
        return numbers._replace(values=-angles_rad if SIDES[side] in self.reversed_sides else angles_rad)


class WheelSource:
    """Collects the messages of some topics, and converts them to wheel angles."""

    are_joint_angles = False  # of joints, which may turn backward when the robot drives forward

    def __init__(
        self, topics: Sequence[str], joints: Tuple[str, str], text: str, numbers: Optional[WheelNumbers] = None
    ) -> None:
        """Prepare to read angles of joints, or numbers of wheels; `text` names the messages in notes."""
        self.topics, self.joints, self.text = tuple(dict.fromkeys(topics)), joints, text
        self.ppr = numbers.ppr if numbers else None  # of the encoder that counted; None if unknown
        self._numbers, self._left_out = numbers, 0
        self.wrap_fault = ''  # of a counter of unknown width
        self.repeated = 0  # rows that repeat a stamp, of which the first is used
        self._columns = [(array('q'), array('q'), array('d')) for _ in joints]

    @property
    def is_start_known(self) -> bool:
        """Return whether angles are recorded: counts, speeds and poses do not contain those at the start."""
        return self.are_joint_angles or (self._numbers is not None and self._numbers.unit in RAD_OF_ANGLE)

    def add(self, message: Message) -> None:
        """Add a message of `topics`; InputFault if it cannot be used."""
        raise NotImplementedError

    def _append(self, side: int, stamp_ns: int, time_ns: int, value: float) -> None:
        stamps_ns, times_ns, values = self._columns[side]
        stamps_ns.append(stamp_ns)
        times_ns.append(time_ns)
        values.append(value)

    def _series(self) -> List[WheelSeries]:
        return [WheelSeries(*map(np.array, columns)) for columns in self._columns]

    def drives(self) -> List[TimedDrive]:
        """Return the drive so far at the stamps of the left wheel; several if stamps go back, as after a reset."""
        series = self._series()
        if self._numbers:
            series = [self._numbers.angles(side, of_side) for side, of_side in enumerate(series)]
            faults = [self._numbers.wrap_fault(side, of_side) for side, of_side in enumerate(series)]
            self.wrap_fault = next(filter(None, faults), '')
        drives, self._left_out = paired_drives(*series)
        self.repeated = max(repeated_stamps(of_side.stamps_ns) for of_side in series)
        return drives

    def notes(self) -> Iterator[str]:
        """List limits of the angles, one line each, after `drives`."""
        if self._numbers:
            yield from self._numbers.notes()
        if self.repeated:
            yield f'{self.repeated} of {len(self._columns[0][0])} {self.text} repeat a stamp: using the first of each'
        if self._left_out:
            gap_s = LONGEST_GAP_NS / NANOSECONDS_PER_SECOND
            yield f'left out: {self._left_out} values of a wheel without one of the other within {gap_s:g} s'


def repeated_stamps(stamps_ns: np.ndarray) -> int:
    """Return how many rows have the stamp of the row before."""
    return int((np.diff(stamps_ns) == 0).sum())


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
    """Return both wheels' angles [rad] at the stamps of the left one, the right one interpolated.

    The number is that of angles of a wheel without one of the other within `LONGEST_GAP_NS` after the first pair.
    """
    drives, left_out = [], 0
    lefts, rights = ([side.at(rows) for rows in ascending_runs(side.stamps_ns)] for side in (left, right))
    for of_left, of_right in zip(lefts, rights):
        stamps_ns, other_ns = of_left.stamps_ns, of_right.stamps_ns
        if not (len(stamps_ns) and len(other_ns)):
            continue
        after = np.searchsorted(other_ns, stamps_ns).clip(max=len(other_ns) - 1)
        before = np.where(other_ns[after] == stamps_ns, after, (after - 1).clip(min=0))
        is_between = (other_ns[before] <= stamps_ns) & (stamps_ns <= other_ns[after])
        is_paired = is_between & (other_ns[after] - other_ns[before] <= LONGEST_GAP_NS)
        paired, right_rad = of_left.at(is_paired), np.interp(stamps_ns, other_ns, of_right.values)[is_paired]
        drives.append(TimedDrive(Drive(paired.stamps_ns, np.column_stack((paired.values, right_rad))), paired.times_ns))
        # The last left angles are followed by no right one.
        is_missed = (np.cumsum(is_paired) > 0) & ~is_paired & (stamps_ns < stamps_ns[-1] - LONGEST_GAP_NS)
        left_out += int(is_missed.sum() + (other_ns > stamps_ns[-1] + LONGEST_GAP_NS).sum())
    return drives, left_out
