"""Which encoders of the catalogue, of the shipped robots and of the user meet a requirement on this robot."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Limit
from diff_encoder_sim.advice.candidates import Candidate, equivalent_counts
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.odometry_answer import own_limits
from diff_encoder_sim.advice.odometry_curve import share_within
from diff_encoder_sim.advice.requirement import Requirement
from diff_encoder_sim.analysis.sample_statistics import Interval
from diff_encoder_sim.robots.robot_file import load_robot_file, robot_names
from diff_encoder_sim.wheels.catalogue import WHOLE_CATALOGUE, load_encoders
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS, PerWheel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

DRAWS = 400


class ListedEncoder(NamedTuple):
    """An encoder on the wheels of this robot."""

    name: str
    price: str  # class of its price; '' of a robot's own
    counts: float  # per revolution of the wheel
    equivalent_counts: float  # of an ideal encoder whose readings are as uncertain
    share: Interval  # of trials whose odometry is within the tolerance, in the test where it is smallest
    meets: Dict[Criterion, Optional[bool]]  # None: not known
    limits: Sequence[Limit] = ()  # its own errors that are too large for odometry

    @property
    def share_text(self) -> str:
        """Return the interval of the share as tables and charts show it."""
        return f'{100.0 * self.share.low:.0f} to {100.0 * self.share.high:.0f} %'


def listed_encoders(
    tests: Sequence[DriveDraws],
    config_folder: Path,
    requirement: Requirement,
    answers: Mapping[Criterion, Answer],
    candidates: Sequence[Candidate] = (),
) -> List[ListedEncoder]:
    """Return the encoders of config/encoders and config/robots, and candidates with a name, by ascending counts.

    Odometry is drawn with each encoder's own errors. At the goal, where localization corrects what grows with the way,
    an encoder counts as the ideal one whose readings are as uncertain.
    """
    found = []
    known = {**_known(config_folder), **{each.name: (each.price, each.params) for each in candidates if each.name}}
    for name, (price, params) in known.items():
        share = min(share_within(draws.errors([params], DRAWS)[0], requirement) for draws in tests)
        like = equivalent_counts(params)
        meets = {Criterion.ODOMETRY: _met(share, requirement)}
        for criterion in (Criterion.POSE_ESTIMATE, Criterion.TRUTH):
            meets[criterion] = None if _loses_counts(params) else _by_counts(like, answers.get(criterion))
        own = _own_limits(tests, params, requirement) if meets[Criterion.ODOMETRY] is False else []
        found.append(ListedEncoder(name, price, params.counts_per_turn.left, like, share, meets, own))
    return sorted(found, key=lambda encoder: (encoder.counts, encoder.name))


def _loses_counts(params: EncoderParams) -> bool:
    """Return whether an encoder has faults, of which the variance of a reading knows nothing."""
    return params.encoder.faults.model_copy(update={'max_count_rate': 0.0}) != NO_FAULTS


def _own_limits(tests: Sequence[DriveDraws], params: EncoderParams, requirement: Requirement) -> List[Limit]:
    """Return the errors of an encoder that keep it from being enough; none if its counts do."""
    ideal = params.model_copy(update={'ppr': params.counts_per_turn, 'encoder': IDEAL_ENCODER})
    share = min(share_within(draws.errors([ideal], DRAWS)[0], requirement) for draws in tests)
    return own_limits(tests, params, requirement, bool(_met(share, requirement)), DRAWS)


def _known(config_folder: Path) -> Dict[str, Tuple[str, EncoderParams]]:
    """Return class of price and parameters by name."""
    catalogue = load_encoders([WHOLE_CATALOGUE], config_folder, Path())
    found = {encoder.stem: (encoder.price, encoder.params) for encoder in catalogue}
    for name in robot_names(config_folder):
        ppr = load_robot_file(name, Path(), config_folder.parent, {}).ppr
        if ppr is not None:
            found[f'own of {name}'] = '', EncoderParams(ppr=PerWheel(left=ppr, right=ppr))
    return found


def _met(share: Interval, requirement: Requirement) -> Optional[bool]:
    if share.low >= requirement.share:
        return True
    return False if share.high < requirement.share else None


def _by_counts(counts: float, answer: Optional[Answer]) -> Optional[bool]:
    """Return whether so many counts are enough; between those that are and those that are not, nobody knows."""
    if answer is None or answer.kind is Kind.UNDECIDED:
        return None
    if answer.kind is Kind.NOT_THE_LIMIT:
        return False
    not_enough, enough = answer.interval
    if enough is not None and counts >= enough:
        return True
    return False if not_enough is not None and counts <= not_enough else None
