"""What a campaign says of its progress and of its outcome."""

import io

from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.progress import ProgressBar, ProgressLines, outcome_table, progress_on
from diff_encoder_sim.trials.results import TrialRow


class Clock:
    """Seconds that pass when a test lets them."""

    now_s = 0.0

    def __call__(self):
        return self.now_s


class Left:
    """A minute for one worker, whatever happens."""

    def add(self, row):
        pass

    def seconds(self, workers):
        return 60.0 / workers


def row(outcome=Outcome.SUCCEEDED, test='SL', ppr='40', varied=()):
    return TrialRow(test, ppr, varied, 1, 1, outcome, '', 50.0, {}, 20.0, 1.0, '')


def lines_of(total, done=()):
    clock, stream = Clock(), io.StringIO()
    return clock, stream, ProgressLines(total, list(done), Left(), stream, clock)


def test_the_first_lines_come_at_once_and_with_the_first_worker():
    clock, stream, progress = lines_of(10)
    for clock.now_s in range(5):
        progress.tick(0 if clock.now_s < 2 else 2)
    assert stream.getvalue().splitlines() == [
        '0 of 10 trials, 0 failed, waiting for workers to start',
        '0 of 10 trials, 0 failed, 2 workers, about 00:30 left',
    ]


def test_a_line_has_counts_speed_and_time_left():
    clock, stream, progress = lines_of(10)
    clock.now_s = 2.0
    progress.tick(2)
    progress.add(row(Outcome.COLLISION))
    assert stream.getvalue().splitlines()[-1] == (
        '1 of 10 trials, 1 failed, 2 workers, 25 x real time, about 00:30 left'
    )


def test_what_was_done_before_counts_but_not_for_speed():
    clock, _, progress = lines_of(10, [row(), row(Outcome.LOST), row(), row(), row()])
    clock.now_s = 4.0
    progress.tick(1)
    progress.add(row())
    assert progress.done_now == 1
    assert progress.text() == '6 of 10 trials, 1 failed, 1 worker, 12 x real time, about 01:00 left'


def test_lines_come_every_tenth_of_the_trials():
    _, stream, progress = lines_of(200)
    progress.tick(1)
    for _ in range(200):
        progress.add(row())
    counts = [int(line.split()[0]) for line in stream.getvalue().splitlines()]
    assert counts == [0, *range(20, 201, 20)]


def test_lines_come_every_thirty_seconds_when_trials_are_slow():
    clock, stream, progress = lines_of(1000)
    for clock.now_s in range(100):
        progress.tick(3)
    assert stream.getvalue().count('0 of 1000 trials, 0 failed, 3 workers, about 00:20 left\n') == 4


def test_a_terminal_gets_a_bar_with_the_same_text():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    stream = Terminal()
    with progress_on(stream, 4, [row()], Left()) as progress:
        assert isinstance(progress, ProgressBar)
        for _ in range(3):
            progress.add(row(Outcome.TIMED_OUT))
    shown = stream.getvalue()
    assert '100% |' in shown
    assert '4 of 4 trials, 3 failed' in shown.split('\r')[-1]
    assert isinstance(progress_on(io.StringIO(), 4, [], Left()), ProgressLines)


def test_outcomes_are_counted_by_cell():
    rows = [row(), row(Outcome.LOST), row(), row(ppr='90'), row(Outcome.COLLISION, 'SMT', '90')]
    assert [line.split() for line in outcome_table(rows).splitlines()[2:]] == [
        ['SL', '40', '3', '2', '0', '1'],
        ['SL', '90', '1', '1', '0', '0'],
        ['SMT', '90', '1', '0', '1', '0'],
    ]
    assert outcome_table(rows).split()[:6] == ['test', 'PPR', 'trials', 'succeeded', 'collision', 'lost']


def test_varied_parameters_have_columns():
    rows = [row(varied=(('simulator.lidar.noise', text),)) for text in ('0.01', '0.03', '0.03')]
    table = [line.split() for line in outcome_table(rows).splitlines()]
    assert table[0][:3] == ['test', 'simulator.lidar.noise', 'PPR']
    assert table[2:] == [['SL', '0.01', '40', '1', '1'], ['SL', '0.03', '40', '2', '2']]
