"""What the terminal shows of results."""

import pytest

from diff_encoder_sim.analysis.terminal_summary import CELL_LEGEND, TRIAL_LEGEND, summary
from trial_tables import IN, OUT, cell, results_of, trial

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
def test_a_row_per_cell_or_if_each_has_one_per_trial(trials, begin, end, legend):
    table, _, rest = summary(results_of(trials)).partition('\n' + legend)
    row = table.splitlines()[-1].split()
    assert (row[: len(begin)], row[-len(end) :], rest) == (begin, end, '')
