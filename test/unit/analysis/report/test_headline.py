"""The headline of the report."""

from diff_encoder_sim.analysis.report.headline import headline, summary_rows
from diff_encoder_sim.analysis.within_tolerance import COMPARED_POSES
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import IN, both, cell, dataset, rows, trial

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


def test_failures_are_counted():
    trials = both('SL', '40', (30, 0), (30, 0))
    trials[7] = trials[7]._replace(outcome=Outcome.COLLISION)
    assert headline(dataset(trials)) == (ENOUGH, dict.fromkeys(TEXTS, 'SL: 40 PPR'), '1 of 30 trials did not succeed.')


def test_few_trials_are_counted_and_called_few():
    assert headline(dataset(both('SL', '40', (5, 0), (1, 4)), both('SL', '90', (4, 1), (5, 0)))) == (
        (
            '5 trials per cell: an illustration; 16 show whether 80 % end within tolerance, and advise tells '
            f'which encoder is needed. Trials that end {TOLERANCE}:'
        ),
        dict(zip(TEXTS, ('SL: 9 of 10', 'SL: 6 of 10', 'SL: 5 of 10'))),
        '',
    )


def test_the_pose_estimate_is_listed_where_there_is_one():
    assert headline(dataset(cell('SL', '40', 'global', rows(30, 0)))).by_source == {
        'pose estimate at the goal': 'SL: 40 PPR'
    }


def test_one_trial_and_none_with_a_pose():
    one = headline(dataset(cell('SL', '40', 'world', [IN])))
    assert one.statement.startswith('1 trial per cell') and one.by_source == {'true pose at the goal': 'SL: 1 of 1'}
    assert headline(dataset([trial('SL', '40', 1, outcome=Outcome.LOST)])).text == (
        'No trial ended with a pose: nothing can be concluded.'
    )


def test_many_sets_of_parameters_are_counted_and_few_are_named():
    def by_source(values):
        return headline(
            dataset(
                *(both('SL', '40', (30, 0), (0, 30), varied=(('simulator.lidar.noise', value),)) for value in values)
            )
        ).by_source

    assert by_source(['0.01', '0.03'])['true pose at the goal'] == 'SL (noise 0.01) and SL (noise 0.03): 40 PPR'
    assert by_source('1234567') == dict(zip(TEXTS, ('in 7 of 7 cells', 'in 0 of 7 cells', 'in 0 of 7 cells')))


def test_encoders_without_one_ppr_are_named_too():
    by_source = headline(
        dataset(
            both('SL', '40', (30, 0), (0, 30)),
            both('SL', '90L1024R', (30, 0), (30, 0)),
            both('SL', 'ideal', (30, 0), (30, 0)),
        )
    ).by_source
    assert by_source['odometry at the true pose'] == 'SL: 90L1024R PPR and ideal odometry'


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


def test_the_summary_has_a_row_for_each_test_and_final_pose():
    rows_of = summary_rows(dataset(cell('SL', '40', 'odom', [IN]), cell('SMT', '90', 'odom', [IN])))
    assert [(row.test, row.pose, list(row.fractions)) for row in rows_of] == [
        (test, pose, [ppr]) for test, ppr in (('SL', '40'), ('SMT', '90')) for pose in COMPARED_POSES
    ]


def test_encoders_are_in_the_order_of_their_pulses_also_where_the_first_test_has_not_all():
    rows_of = summary_rows(
        dataset(cell('SL', '90', 'odom', [IN]), cell('SMT', '40', 'odom', [IN]), cell('SMT', '90', 'odom', [IN]))
    )
    assert [list(row.fractions) for row in rows_of if row.pose is COMPARED_POSES[-1]] == [['90'], ['40', '90']]
