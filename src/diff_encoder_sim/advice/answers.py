"""The three kinds of answers to "which encoder?", for odometry, for the pose estimate and for the true pose."""

from __future__ import annotations

import enum
import math
from typing import NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.advice.budget import AXES
from diff_encoder_sim.analysis.encoder_labels import ppr_text, ppr_value


class Criterion(enum.Enum):
    """What is to be within the tolerance; the value is its name in JSON."""

    ODOMETRY = 'odometry'
    POSE_ESTIMATE = 'pose_estimate'
    TRUTH = 'truth'

    @property
    def head(self) -> str:
        """Return what heads of tables call it."""
        return 'true pose' if self is Criterion.TRUTH else self.value.replace('_', ' ')

    @property
    def text(self) -> str:
        """Return the same with what it is compared with."""
        return f'{self.head} at the {"true pose" if self is Criterion.ODOMETRY else "goal"}'


class Kind(enum.Enum):
    """The value is its name in JSON."""

    FROM = 'from'
    NOT_THE_LIMIT = 'not_the_limit'
    UNDECIDED = 'undecided'


class Limit(NamedTuple):
    """Something else than the encoder that takes too much of a tolerance by itself."""

    cause: str
    test: str
    axis: int  # of AXES
    error: float  # which the required share of trials does not exceed by this cause alone: [m] or [rad]
    tolerance: float
    reduced_to: float  # the same error, if there were less of the cause

    def __str__(self) -> str:
        return f'{self.cause} makes {self.amount} {AXES[self.axis]} in {self.test}'

    @property
    def amount(self) -> str:
        """Return the error and the tolerance: `47 of 50 mm`."""
        if AXES[self.axis] == 'heading':
            return f'{_rounded(math.degrees(self.error), 2)} of {math.degrees(self.tolerance):g} degrees'
        return f'{_rounded(1e3 * self.error, 3)} of {1e3 * self.tolerance:g} mm'

    @property
    def reduced(self) -> str:
        """Return the smaller error in words."""
        return f'{self.cause} made {_in_words(self.reduced_to, self.axis)}'


class Answer(NamedTuple):
    """An answer. Counts are per revolution of the wheel."""

    criterion: Criterion
    kind: Kind
    counts: Optional[float] = None  # from which on the requirement is met; of the other kinds with the limits reduced
    interval: Tuple[Optional[float], Optional[float]] = (None, None)  # not enough, or unknown; enough for certain
    encoder: str = ''  # label of the candidate with these counts
    limits: Sequence[Limit] = ()
    more_trials: Optional[int] = None  # of each test, that would decide: of `undecided`, or of the finest candidate
    undecided: str = ''  # label of the candidate below `encoder` of which nobody knows
    of_encoder: bool = False  # with these limits an encoder without errors of its own would be enough
    errors_of: str = ''  # label of the candidate whose own errors are among the limits
    given_up: str = ''  # which trials do not come to their goal, whatever the encoder
    note: str = ''

    def __str__(self) -> str:
        if self.kind is Kind.FROM:
            text = f'from {_counts(self.counts)} counts per revolution on'
            text = f'{text}{self._interval()}{self._candidate()}{self._undecided()}'
        elif self.kind is Kind.NOT_THE_LIMIT:
            what = "the encoder's counts are" if self.of_encoder else 'the encoder is'
            name = f'{ppr_text(self.errors_of)}: ' if self.errors_of else ''
            text = f'{name}{what} not the limit: {self._limits()}'
        else:
            text = f'undecided{self._more_trials()}'
        return f'{text}; {self.note}' if self.note else text

    @property
    def budgeted_counts(self) -> Optional[float]:
        """Return the counts whose budget explains this answer."""
        return ppr_value(self.errors_of) if self.errors_of else self.counts

    def _interval(self) -> str:
        low, high = self.interval
        if low is None:
            return '' if self.undecided else ', the coarsest candidate'
        if self.encoder == _counts(self.counts):
            return f'; {_counts(low)} are not enough'
        return f' (between {_counts(low)} and {_counts(high)})' if low != high else ''

    def _candidate(self) -> str:
        is_known = self.encoder in ('', _counts(self.counts))
        return '' if is_known else f'; of the candidates {ppr_text(self.encoder)}'

    def _undecided(self) -> str:
        return f'; {ppr_text(self.undecided)} undecided{self._more_trials()}' if self.undecided else ''

    def _more_trials(self) -> str:
        if self.more_trials is None:
            return ''
        return f', about {self.more_trials} more trials of each test would decide'

    def _limits(self) -> str:
        if not self.limits:
            return self.given_up or 'several causes together are, none by itself'
        less = ' and '.join(limit.reduced for limit in self.limits)
        with_less = f'from {_counts(self.counts)} counts on' if self.counts else 'still not'
        return f'{" and ".join([*filter(None, [self.given_up]), *map(str, self.limits)])}; if {less}: {with_less}'


def _counts(counts: Optional[float]) -> str:
    return '-' if counts is None else f'{counts:.6g}'


def _rounded(value: float, digits: int) -> str:
    """Return a number with so many significant digits, without an exponent below a million."""
    return f'{float(f"{value:.{digits}g}"):g}'


def _in_words(error: float, axis: int) -> str:
    return (
        f'{_rounded(math.degrees(error), 2)} degrees' if AXES[axis] == 'heading' else f'{_rounded(1e3 * error, 2)} mm'
    )
