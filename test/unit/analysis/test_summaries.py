"""The table for the terminal, the fraction of trials within tolerance by hand, and the headline."""

import pytest

from diff_encoder_sim.analysis import summaries
from diff_encoder_sim.analysis.summaries import CELL_LEGEND, TRIAL_LEGEND, Sufficiency, fractions_within
from trial_tables import IN, OUT, TURNED, both, cell, results_of, rows, trial

# Of results without pose estimates.
TEXTS = ('true pose at the goal', 'odometry at the goal', 'odometry at the true pose')

ODOMETRY = [trial('SL', '40', number, odom=odom, world=OUT) for number, odom in enumerate((IN, OUT, OUT), start=1)]
FAILED = cell('SL', '40', 'world', [IN, OUT]) + [trial('SL', '40', 3, 'lost')]
LATE = [trial('SL', '40', 1, 'timed_out', world=(0.3, -0.4, 2.0))]


@pytest.mark.parametrize(
    ('trials', 'begin', 'end', 'legend'),
    [
        (FAILED, ['SL', '40', '3', '2'], ['50', '0.2263'], CELL_LEGEND),  # 0.32 m / sqrt(2)
        (ODOMETRY, ['SL', '40', '3', '3'], ['0', '0.0000', '67', '0.1848'], CELL_LEGEND),  # 0.32 m / sqrt(3)
        (ODOMETRY[:1], ['SL', '40', '1', 'succeeded', '60.0', '20.00'], ['0.3200', '+0.00'], TRIAL_LEGEND),
        (LATE, ['SL', '40', '1', 'timed', 'out'], ['0.5000', '+2.00'], TRIAL_LEGEND),
    ],
)
def test_the_terminal_has_a_row_per_cell_or_if_each_has_one_per_trial(trials, begin, end, legend):
    table, _, rest = summaries.summary(results_of(trials)).partition('\n' + legend)
    row = table.splitlines()[-1].split()
    assert (row[: len(begin)], row[-len(end) :], rest) == (begin, end, '')


def fraction(trials, pose='odom'):
    found = fractions_within(results_of(trials))
    return found[found['pose'] == pose].iloc[0]


def headline_of(*cells):
    results = results_of(*cells)
    return summaries.headline(fractions_within(results), results.trials)


def test_a_fraction_is_of_the_trials_with_a_pose_and_joint_over_position_and_heading():
    trials = cell('SL', '90', 'odom', [IN, IN, OUT, TURNED, None])
    assert tuple(fraction(trials)[['trials', 'within', 'position', 'heading']]) == (4, 2, 3, 3)
    assert fraction(trials, 'world')['trials'] == 0


@pytest.mark.parametrize(
    ('inside', 'sufficiency'),
    [(29, Sufficiency.YES), (28, Sufficiency.UNDECIDED), (20, Sufficiency.UNDECIDED), (19, Sufficiency.NO)],
)
def test_a_fraction_is_sufficient_by_wilsons_interval(inside, sufficiency):
    # 28 of 30: 0.787 to 0.982; 29: 0.833 to 0.994; 20: 0.488 to 0.808; 19: 0.455 to 0.781.
    assert fraction(cell('SL', '90', 'odom', rows(inside, 30 - inside)))['sufficiency'] == sufficiency.value
    assert summaries.fewest_trials() == 16  # n / (n + 1.96^2) >= 0.8 from n = 15.4 on


def test_the_headline_names_encoders_by_test_and_pose():
    """Trials of each cell that are within tolerance, of 30: true poses and odometry."""
    within = {
        'SL': {'40': (30, 0), '90': (30, 25), '1024': (30, 30), '4096': (30, 30)},
        'SMT': {'40': (30, 30), '90': (0, 30), '1024': (30, 30), '4096': (0, 30)},
        'DLD': {'40': (30, 0), '90': (30, 0)},
    }
    cells = [(test, ppr, *counts) for test, of_test in within.items() for ppr, counts in of_test.items()]
    trials = [both(test, ppr, (true, 30 - true), (odom, 30 - odom)) for test, ppr, true, odom in cells]
    texts = (
        'SL and DLD: every encoder; SMT: 40 and 1024 counts',
        'SL: from 1024 counts (90 counts undecided); SMT: every encoder; DLD: no encoder',
        'SL: from 1024 counts (90 counts undecided); SMT: 40 and 1024 counts; DLD: no encoder',
    )
    found, enough = headline_of(*trials), f'at least 80 % of trials end {summaries.TOLERANCE_TEXT} (95 % confidence):'
    assert found == (f'Encoders with which {enough}', dict(zip(TEXTS, texts)), '')
    assert found.text.splitlines()[1] == f'  true pose at the goal:     {texts[0]}'


def test_few_trials_are_counted():
    found = headline_of(both('SL', '40', (5, 0), (1, 4)), both('SL', '90', (4, 1), (5, 0)))
    assert found.statement.startswith('5 trials per cell: too few trials (16 needed')
    assert found.by_pose == dict(zip(TEXTS, ('SL: 9 of 10', 'SL: 6 of 10', 'SL: 5 of 10')))
    assert headline_of([trial('SL', '40', 1, 'lost')]).by_pose == {}
    failed = cell('SL', '40', 'world', rows(1, 1), outcome='collision')
    assert headline_of(failed).failures.startswith('2 of 2 trials did not succeed')


def test_parameters_are_named_by_the_last_part_of_their_keys():
    made = [trial('SL', '40', 1, world=IN, **{'config.slip': slip}) for slip in ('0', '0.1')]
    found = fractions_within(results_of(made, varied=['config.slip']))
    expected = {(f'SL, config.slip {slip}', f'SL (slip {slip})') for slip in ('0', '0.1')}
    assert set(zip(found['setup'], found['name'])) == expected
