"""What the terminal shows of results."""

from diff_encoder_sim.analysis.terminal_summary import cell_table, summary, trial_table
from trial_tables import IN, OUT, cell, results_of, trial


def last_row(table):
    return table.splitlines()[-1].split()


def test_a_cell_counts_its_trials_and_those_within():
    trials = cell('SL', '40', 'world', [IN, OUT, None])
    trials[2]['outcome'] = 'lost'
    assert last_row(cell_table(results_of(trials))) == ['SL', '40', '3', '2', '50', '0.2263']  # 0.32 m / sqrt(2)
    assert 'std dev: standard deviation' in summary(results_of(trials))


def test_a_trial_shows_its_outcome_and_errors():
    made = results_of([trial('SL', '40', 1, 'timed_out', world=(0.3, -0.4, 2.0))])
    assert last_row(trial_table(made)) == ['SL', '40', '1', 'timed', 'out', '60.0', '20.00', '0.5000', '+2.00']
    assert summary(made).startswith(trial_table(made))


def test_odometry_is_compared_with_the_truth_too():
    trials = [trial('SL', '40', number, odom=odom, world=OUT) for number, odom in enumerate((IN, OUT, OUT), start=1)]
    assert last_row(cell_table(results_of(trials)))[-4:] == ['0', '0.0000', '67', '0.1848']  # 0.32 m / sqrt(3)
    assert last_row(trial_table(results_of(trials[:1])))[-2:] == ['0.3200', '+0.00']
