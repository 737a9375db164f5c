"""Requirement, error budget and answers of an advice."""

from __future__ import annotations

import enum
import math
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import ppr_text, ppr_value
from diff_encoder_sim.analysis.quantities import LEVEL, REQUIRED_FRACTION, YAW, X
from diff_encoder_sim.base.rounding import rounded, turns_text
from diff_encoder_sim.base.se2 import Pose2D

VERDICTS = 5  # about as many encoders are refused in a search; they share the chance of error (Bonferroni)


class Requirement(NamedTuple):
    """Required fraction of trials within a tolerance."""

    share: float = REQUIRED_FRACTION  # of trials, 0 to 1
    position_m: float = X.tolerance  # in x and in y
    yaw_rad: float = math.radians(YAW.tolerance)
    confidence: float = LEVEL  # of answers

    @property
    def tolerances(self) -> np.ndarray:
        """Return (3,) the allowed absolute errors in x [m], y [m] and yaw [rad]."""
        return np.array([self.position_m, self.position_m, self.yaw_rad])

    @property
    def doubt(self) -> float:
        """Return the chance of error of one verdict about trials."""
        return (1.0 - self.confidence) / VERDICTS

    def within(self, errors: np.ndarray) -> np.ndarray:
        """Return (n,) bool: which of (n, 3) errors are within the tolerances; NaN is not."""
        return np.asarray((np.abs(errors) <= self.tolerances).all(axis=1))

    def __str__(self) -> str:
        return (
            f'at least {100 * self.share:g} % of the trials within {self.position_m:g} m in x and y and '
            f'{math.degrees(self.yaw_rad):g} degrees'
        )


def along_goal(errors: np.ndarray, goal_in_map: Pose2D) -> np.ndarray:
    """Rotate (n, 3) errors from the map's axes to AXES of the goal."""
    cos, sin = math.cos(goal_in_map.yaw_rad), math.sin(goal_in_map.yaw_rad)
    x_m, y_m, yaw_rad = errors.T
    return np.column_stack([cos * x_m + sin * y_m, cos * y_m - sin * x_m, yaw_rad])


AXES = ('along', 'across', 'heading')  # of all budgets: along the heading at the goal, to its left, the heading
AXIS_TEXT = {'along': 'along the path', 'across': 'sideways', 'heading': 'of heading'}


def amount_text(error: float, axis: str, digits: int = 2) -> str:
    """Return an error [m or rad] in metres, millimetres or degrees: `0.14 m`."""
    if axis == 'heading':
        return f'{rounded(math.degrees(error), digits):g} degrees'
    return f'{rounded(error, digits):g} m' if error >= 0.1 else f'{rounded(1e3 * error, digits):g} mm'


class Part(NamedTuple):
    """Mean and variance of an error, (3,) by AXES: [m], [m], [rad]; [m^2], [m^2], [rad^2]."""

    bias: np.ndarray
    variance: np.ndarray

    @property
    def std(self) -> np.ndarray:
        """Return the (3,) standard deviation; negative for a rest with negative variance."""
        return np.asarray(np.sign(self.variance) * np.sqrt(np.abs(self.variance)))


class Budget(NamedTuple):
    """Contributions of independent causes, and the observed error."""

    parts: Dict[str, Part]  # by cause
    found: Part

    @property
    def rest(self) -> Part:
        """Return the observed error minus the sum of the causes."""
        return Part(
            self.found.bias - sum(part.bias for part in self.parts.values()),
            self.found.variance - sum(part.variance for part in self.parts.values()),
        )

    @property
    def position_fractions(self) -> Dict[str, float]:
        """Return the fraction of the variance of the position that each cause makes."""
        found_m2 = max(float(self.found.variance[:2].sum()), 1e-18)
        return {cause: float(part.variance[:2].sum()) / found_m2 for cause, part in self.every.items()}

    @property
    def every(self) -> Dict[str, Part]:
        """Return the parts by cause, the rest and the observed error."""
        return {**self.parts, 'rest': self.rest, 'found': self.found}


def part_of(errors: np.ndarray) -> Part:
    """Return mean and variance of (n, 3) errors by AXES."""
    return Part(errors.mean(axis=0), errors.var(axis=0, ddof=1) if len(errors) > 1 else np.zeros(3))


def added(errors: np.ndarray, without: np.ndarray) -> Part:
    """Return the contribution of a cause from paired (n, 3) errors with and without it."""
    return Part(*np.subtract(part_of(errors), part_of(without)))


class Criterion(str, enum.Enum):
    """Pose that must be within the tolerance; the value is the name in JSON."""

    ODOMETRY = 'odometry'
    POSE_ESTIMATE = 'pose_estimate'
    TRUTH = 'truth'

    @property
    def head(self) -> str:
        """Return the name in table heads."""
        return 'true pose' if self is Criterion.TRUTH else self.value.replace('_', ' ')

    @property
    def text(self) -> str:
        """Return the name with the reference pose."""
        return f'{self.head} at the {"true pose" if self is Criterion.ODOMETRY else "goal"}'


class Kind(str, enum.Enum):
    """Kind of an answer; the value is the name in JSON."""

    FROM = 'from'
    NOT_THE_LIMIT = 'not_the_limit'
    UNDECIDED = 'undecided'


class Limit(NamedTuple):
    """Cause other than the resolution that takes too much of a tolerance."""

    cause: str
    test: str
    axis: str  # of AXES
    error: float  # quantile of this cause's error at the required success rate [m or rad]
    tolerance: float
    reduced_to: float  # error that would leave room for other causes

    def __str__(self) -> str:
        error, allowed = amount_text(self.error, self.axis), amount_text(self.tolerance, self.axis, 6)
        return f'{self.cause} makes {error} {AXIS_TEXT[self.axis]} in {self.test}, {allowed} allowed'

    @property
    def fraction(self) -> float:
        """Return the error in units of the tolerance."""
        return self.error / self.tolerance

    @property
    def amount(self) -> str:
        """Return the error and the tolerance: `47 mm, 50 mm allowed`."""
        return f'{amount_text(self.error, self.axis)}, {amount_text(self.tolerance, self.axis, 6)} allowed'

    @property
    def reduced(self) -> str:
        """Return the condition for an encoder to suffice: `stopping made 25 mm`."""
        return f'{self.cause} made {amount_text(self.reduced_to, self.axis)}'


class Travel(NamedTuple):
    """Part of a drive from its start."""

    distance_m: float
    turned_rad: float

    def __str__(self) -> str:
        if self.distance_m < 0.01 * self.turned_rad:  # in place
            return turns_text(rounded(self.turned_rad / (2.0 * math.pi)))
        return amount_text(self.distance_m, 'along')


class Reach(NamedTuple):
    """Error of all wheel errors together, without quantisation, and how far the tolerance holds."""

    test: str
    axis: str  # of AXES, that with the largest fraction of its tolerance
    error: float  # quantile of the worst axis at the required success rate, in units of this one [m or rad]
    tolerance: float
    after: Travel  # the drive
    holds_for: Travel

    def __str__(self) -> str:
        error, tolerance = amount_text(self.error, self.axis), amount_text(self.tolerance, self.axis, 6)
        off = f'{error} {AXIS_TEXT[self.axis]} after {self.after}, {tolerance} allowed'
        return f'{off}: the encoder is not the limit; {tolerance} hold for {self.holds_for}'


DECODING, MOTOR_LINES = 4, 12  # of the encoders that `Answer.lines` describes


class Answer(NamedTuple):
    """Answer for one criterion. Counts are per revolution of the wheel."""

    criterion: Criterion
    kind: Kind
    counts: Optional[float] = None  # lowest sufficient counts; for NOT_THE_LIMIT with reduced limits
    # Highest insufficient counts (None: unknown), lowest certain ones.
    interval: Tuple[Optional[float], Optional[float]] = (None, None)
    encoder: str = ''  # label of the sufficient candidate
    limits: Sequence[Limit] = ()
    more_trials: Optional[int] = None  # per test, to decide `undecided` or the finest candidate
    undecided: str = ''  # label of the undecided candidate below `encoder`
    of_encoder: bool = False  # an error-free encoder would suffice despite these limits
    errors_of: str = ''  # label of the candidate whose own errors are among the limits
    given_up: str = ''  # trials that fail to reach the goal with any encoder
    reach: Optional[Reach] = None  # if wheel errors exceed the tolerance
    note: str = ''

    @property
    def lines(self) -> str:
        """Return encoders with these counts, on the wheel and on a motor: whole lines, a gear of two digits; or ''."""
        if self.kind is not Kind.FROM or self.counts is None:
            return ''
        lines = math.ceil(self.counts / DECODING)
        text = f'{DECODING * lines} counts per wheel turn = {lines} lines x{DECODING} on the wheel'
        gear = self.counts / (DECODING * MOTOR_LINES)
        if gear <= 1.0:
            return text
        step = 10.0 ** (math.floor(math.log10(gear)) - 1)
        gear = step * math.ceil(gear / step - 1e-9)
        return f'{text}, or {MOTOR_LINES} lines x{DECODING} on a motor with a {gear:.6g}:1 gear'

    @property
    def budgeted_counts(self) -> Optional[float]:
        """Return the counts whose budget explains this answer."""
        return ppr_value(self.errors_of) if self.errors_of else self.counts

    def __str__(self) -> str:
        count = self.more_trials
        more = '' if count is None else f', about {count} more trials of each test would decide'
        if self.kind is Kind.FROM:
            text = f'at least {_counts(self.counts)} counts per wheel turn{self._interval()}'
            if self.encoder not in ('', _counts(self.counts)):
                text += f'; smallest tested: {ppr_text(self.encoder)}'
            if self.undecided:
                text += f'; {ppr_text(self.undecided)} undecided{more}'
        elif self.reach:
            text = str(self.reach)
        elif self.kind is Kind.NOT_THE_LIMIT:
            what = "the encoder's counts are" if self.of_encoder else 'the encoder is'
            text = f'{ppr_text(self.errors_of)}: ' if self.errors_of else ''
            text += f'{what} not the limit: {self._limits()}'
        else:
            text = f'undecided{more}'
        return f'{text}; {self.note}' if self.note else text

    def _interval(self) -> str:
        low, high = self.interval
        if low is None:
            return '' if self.undecided else ', the coarsest candidate'
        if self.encoder == _counts(self.counts):
            return f'; {_counts(low)} do not suffice'
        return f' (between {_counts(low)} and {_counts(high)})' if low != high else ''

    def _limits(self) -> str:
        if not self.limits:
            return self.given_up or 'several causes together are, no single cause'
        less = ' and '.join(limit.reduced for limit in self.limits)
        with_less = f'at least {_counts(self.counts)} counts' if self.counts else 'still not'
        named = ' and '.join([*filter(None, [self.given_up]), *map(str, self.limits)])
        return f'{named}; if {less}: {with_less}'


def _counts(counts: Optional[float]) -> str:
    return '-' if counts is None else f'{counts:.6g}'


MOST_BY_ONE_CAUSE = 0.5  # of the tolerance; more leaves too little for the other causes


def limits(
    by_place: Mapping[Tuple[str, str], np.ndarray], requirement: Requirement, is_some_cause: bool = False
) -> List[Limit]:
    """Return the causes that are limits, the worst first, each in its worst test and axis.

    `by_place` are (n, 3) errors by AXES that only this cause makes, by cause and test. If no cause is a limit but
    `is_some_cause`, the worst one is, reduced to half of its error.
    """
    tolerances = requirement.tolerances.tolist()
    worst: Dict[str, Limit] = {}
    for (cause, test), errors in by_place.items():
        quantiles = np.quantile(np.abs(errors), requirement.share, axis=0).tolist() if len(errors) else []
        for axis, error, tolerance in zip(AXES, quantiles, tolerances):
            limit = Limit(cause, test, axis, error, tolerance, min(error, MOST_BY_ONE_CAUSE * tolerance))
            worst[cause] = max(worst.get(cause, limit), limit, key=lambda one: one.fraction)
    ordered = sorted(worst.values(), key=lambda limit: -limit.fraction)
    found = [limit for limit in ordered if limit.error > limit.reduced_to]
    if is_some_cause and not found:
        return [limit._replace(reduced_to=0.5 * limit.error) for limit in ordered[:1]]
    return found
