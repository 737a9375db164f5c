#!/usr/bin/env python3
"""How often advise's closed-loop trials give a wrong answer, where the truth is known.

Trials of two tests with twelve encoders end within the tolerance by chances that each curve gives for one test; in the
other test by the same ("both"), or always ("one"), where an error of one test alone is enough. Trials of equal number
have a part in common at all encoders, by a correlation. The search begins at a guess, which is off by so many steps.

wrong: what is recommended does not suffice; none: no encoder is said to suffice, though one does; undecided: with how
many more trials would decide; steps: from the smallest encoder that suffices to the recommended one; within 1: how many
of the recommended ones are no more than one step from it; trials: of both tests together.
"""

from __future__ import annotations

import argparse
import itertools
from types import SimpleNamespace
from typing import Dict, List, Optional, Tuple

import numpy as np
from bench import COUNT, parser, print_header, print_table
from scipy.stats import norm

from diff_encoder_sim.advice.answers import Answer, Kind, Requirement
from diff_encoder_sim.advice.encoder_search import FORGIVEN, TrialCounts, fewest_trials, search

RANKS = 12
CANDIDATES = [SimpleNamespace(label=str(rank), counts=float(rank)) for rank in range(RANKS)]
TESTS = ('SL', 'SMT')
QUESTION = 'truth'
ALWAYS = 0.999
MIDDLE = RANKS // 2  # where no encoder suffices, guesses are off from here


def curves(share: float) -> Dict[str, np.ndarray]:
    """Return the chances by rank of each shape."""
    rank = np.arange(RANKS)
    below, above = share - 0.01, share + 0.01
    middle = share + 0.5 * (1.0 - share)
    # Lateral error of whole pulses, candidates in steps of sqrt(2): P = 1 - (1 - c)^2.
    needed = 1.0 - np.sqrt(1.0 - share)
    straight = 1.0 - (1.0 - np.minimum(1.0, needed * 2.0 ** (0.5 * (rank - 5.5)))) ** 2
    just = 1.0 - (1.0 - np.minimum(1.0, needed * 2.0 ** (0.5 * (rank - 5.05)))) ** 2
    return {
        'a step': np.where(rank < 5, 0.1, ALWAYS),
        'a straight line': straight,
        'just below, then above': just,
        'flat': share + 0.045 * (rank - 6.7) * 5.0 * (1.0 - share),
        'one just below': np.where(rank < 5, 0.4, np.where(rank < 6, below, ALWAYS)),
        'nine just below': np.where(rank < 9, below, ALWAYS),
        'all just below': np.full(RANKS, below),
        'up to share - 0.1': np.minimum(share - 0.1, 0.2 + 0.1 * rank),
        'up to share - 0.3': np.minimum(share - 0.3, 0.2 + 0.1 * rank),
        'all just above': np.full(RANKS, above),
        'up to between share and 1': np.minimum(middle, 0.2 + 0.15 * rank),
    }


def main() -> None:
    made = parser(__doc__, searches=600)
    made.add_argument('--correlations', type=float, nargs='+', default=[0.0, 0.5, 0.9], help='taken in turn')
    made.add_argument('--guesses', type=int, nargs='+', default=[0, -5], help='steps off the right rank')
    made.add_argument('--share', type=float, default=Requirement().share)
    made.add_argument('--confidence', type=float, default=Requirement().confidence)
    made.add_argument('--trials', type=COUNT, help="of each test with each encoder (default: advise's)")
    options = made.parse_args()
    asked = Requirement(options.share, confidence=options.confidence)
    options.trials = options.trials or fewest_trials(asked, FORGIVEN)
    required = f'share {asked.share:g}, confidence {asked.confidence:g}'
    print_header(f'Answers of {options.searches} searches a row [%], {options.trials} trials of a test: {required}')
    rows = [
        [name, tests, off, *_rates(chances, tests == 'both', off, asked, options)]
        for name, chances in curves(asked.share).items()
        for tests in ('one', 'both')
        for off in options.guesses
    ]
    headers = ['chances', 'tests', 'guess', 'wrong', 'none', 'undecided', 'steps', 'within 1', 'trials']
    print_table([['-' if cell is None else cell for cell in row] for row in rows], headers, 2)


def _rates(
    chances: np.ndarray, in_both: bool, off: int, asked: Requirement, options: argparse.Namespace
) -> Tuple[Optional[float], ...]:
    chances = np.clip(chances, 0.001, ALWAYS)
    sufficient = np.nonzero(chances >= asked.share)[0]
    lowest = int(sufficient[0]) if len(sufficient) else None
    guess = int(np.clip((MIDDLE if lowest is None else lowest) + off, 0, RANKS - 1))
    by_test = np.array([chances, chances if in_both else np.full(RANKS, ALWAYS)])
    rng = np.random.default_rng(1)
    correlations = itertools.islice(itertools.cycle(options.correlations), options.searches)
    found = [_search(by_test, correlation, guess, asked, options.trials, rng) for correlation in correlations]
    answers, trials = zip(*found)
    percents = {kind: 100.0 * np.mean([answer.kind is kind for answer in answers]) for kind in Kind}
    ranks = np.array([answer.encoder for answer in answers if answer.encoder], dtype=int)
    steps = None if lowest is None or not len(ranks) else ranks - lowest
    return (
        100.0 * np.count_nonzero(chances[ranks] < asked.share) / len(found),
        None if lowest is None else percents[Kind.NOT_THE_LIMIT],
        percents[Kind.UNDECIDED],
        None if steps is None else float(np.mean(steps)),
        None if steps is None else 100.0 * float(np.mean(np.abs(steps) <= 1)),
        float(np.mean(trials)),
    )


def _search(
    by_test: np.ndarray, correlation: float, guess: int, asked: Requirement, trials: int, rng: np.random.Generator
) -> Tuple[Answer, int]:
    """Draw (tests, ranks, trials) outcomes, and search; return the answer, and the trials of it."""
    common = rng.standard_normal((len(TESTS), 1, trials))
    own = rng.standard_normal((len(TESTS), RANKS, trials))
    drawn = np.sqrt(correlation) * common + np.sqrt(1.0 - correlation) * own
    within = (drawn <= norm.ppf(by_test)[:, :, np.newaxis]).sum(axis=2)
    tested: List[int] = []

    def run(rank: int) -> Dict[str, List[TrialCounts]]:
        tested.append(rank)
        return {QUESTION: [TrialCounts(int(of_test[rank]), trials) for of_test in within]}

    return search(CANDIDATES, run, {QUESTION: guess}, asked)[QUESTION], len(TESTS) * trials * len(tested)


if __name__ == '__main__':
    main()
