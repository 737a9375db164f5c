"""The headline of the report."""

from diff_encoder_sim.analysis.report.headline import headline, summary_rows
from diff_encoder_sim.analysis.within_tolerance import COMPARED_POSES
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import IN, both, cell, dataset

TOLERANCE = 'within 0.05 m in x and y and 3 degrees'

# Of a dataset without pose estimates.
TEXTS = ('true pose at the goal', 'odometry at the goal', 'odometry at the true pose')

ENOUGH = f'Encoders with which at least 80 % of trials end {TOLERANCE} (95 % confidence):'


def test_the_headline_names_encoders_by_test_and_source():
    assert headline(
        dataset(
            both('SL', '40', (30, 0), (0, 30)),
            both('SL', '90', (30, 0), (25, 5)),
            both('SL', '1024', (30, 0), (30, 0)),
            both('SL', '4096', (30, 0), (30, 0)),
            both('SMT', '40', (30, 0), (30, 0)),
            both('SMT', '90', (0, 30), (30, 0)),
            both('SMT', '1024', (30, 0), (30, 0)),
            both('SMT', '4096', (0, 30), (30, 0)),
            both('DLD', '40', (30, 0), (0, 30)),
            both('DLD', '90', (30, 0), (0, 30)),
        )
    ) == (
        ENOUGH,
        {
            'true pose at the goal': 'SL and DLD: every encoder; SMT: 40 and 1024 PPR',
            'odometry at the goal': 'SL: from 1024 PPR (90 PPR undecided); SMT: every encoder; DLD: no encoder',
            'odometry at the true pose': 'SL: from 1024 PPR (90 PPR undecided); SMT: 40 and 1024 PPR; DLD: no encoder',
        },
        '',
    )


def test_few_trials_are_counted_and_called_few():
    assert headline(dataset(both('SL', '40', (5, 0), (1, 4)), both('SL', '90', (4, 1), (5, 0)))) == (
        (
            '5 trials per cell: too few trials (16 needed for 80 %); run advise to choose an encoder. '
            f'Trials that end {TOLERANCE}:'
        ),
        dict(zip(TEXTS, ('SL: 9 of 10', 'SL: 6 of 10', 'SL: 5 of 10'))),
        '',
    )


def test_the_text_is_a_line_for_each_source():
    trials = both('SL', '40', (30, 0), (0, 30))
    trials[7] = trials[7]._replace(outcome=Outcome.COLLISION)
    assert headline(dataset(trials)).text.splitlines() == [
        ENOUGH,
        '  true pose at the goal:     SL: 40 PPR',
        '  odometry at the goal:      SL: no encoder',
        '  odometry at the true pose: SL: no encoder',
        '1 of 30 trials did not succeed.',
    ]


def test_encoders_are_in_the_order_of_their_pulses_also_where_the_first_test_has_not_all():
    rows_of = summary_rows(
        dataset(cell('SL', '90', 'odom', [IN]), cell('SMT', '40', 'odom', [IN]), cell('SMT', '90', 'odom', [IN]))
    )
    assert [list(row.fractions) for row in rows_of if row.pose is COMPARED_POSES[-1]] == [['90'], ['40', '90']]


def test_failures_are_counted():
    trials = both('SL', '40', (30, 0), (30, 0))
    trials[7] = trials[7]._replace(outcome=Outcome.COLLISION)
    assert headline(dataset(trials)) == (ENOUGH, dict.fromkeys(TEXTS, 'SL: 40 PPR'), '1 of 30 trials did not succeed.')
