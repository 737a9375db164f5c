"""The command: what it prints, and where it writes."""

import pytest

from diff_encoder_sim.api import results
from diff_encoder_sim.cli import analyze
from trial_bags import TRUTH, trial, write_bag


@pytest.fixture(autouse=True)
def fixture_quick(monkeypatch):
    """Files that take no time to make."""

    def write_analysis(made, folder, beside=None):
        (folder / 'report.html').write_text(made.title)
        return f'{len(made.trials)} trials' + (f' beside {len(beside.trials)}' if beside else '')

    monkeypatch.setattr(results, 'write_analysis', write_analysis)


def refusal(*arguments):
    with pytest.raises(SystemExit) as caught:
        analyze.main([str(argument) for argument in arguments])
    assert '\n' not in str(caught.value.code)
    return str(caught.value.code)


def test_single_trials_have_a_row_each(tmp_path, capsys):
    write_bag(tmp_path / 'a.bag', trial())
    write_bag(tmp_path / 'b.bag', trial(ppr=90), result=None)
    analyze.main([str(tmp_path)])
    printed = capsys.readouterr().out
    assert printed.count('succeeded') == 1 and printed.count('torn') == 1
    assert '0.5099' in printed and '+2.86' in printed  # odometry ends (-0.1, 0.5) m and 0.05 rad off the goal
    assert printed.endswith(f'\n2 trials\nReport: {tmp_path}/analysis/report.html\n')


def test_several_trials_of_a_cell_are_pooled(tmp_path, capsys):
    for number, y_m in enumerate((0.02, 0.04, 0.06), start=1):
        write_bag(tmp_path / f'{number}.bag', trial(number=number), truth=[*TRUTH[:2], (10.0, y_m, 0.0)])
    analyze.main([str(tmp_path)])
    row = next(line.split() for line in capsys.readouterr().out.splitlines() if line.split()[:2] == ['SL', '40'])
    # odom, world, and odom minus world; the others are silent.
    assert row == ['SL', '40', '3', '3', '0', '0.0000', '67', '0.0200', '0', '0.0200']


def test_what_is_wrong_is_said_and_the_rest_is_analysed(tmp_path, capsys, caplog):
    write_bag(tmp_path / 'a.bag', trial())
    (tmp_path / 'b.bag').write_bytes(b'')
    analyze.main([str(tmp_path)])
    assert [record.message.split(': ')[0] for record in caplog.records] == [f'{tmp_path}/b.bag']
    assert 'succeeded' in capsys.readouterr().out


def test_nothing_to_analyse_is_one_line_and_leaves_nothing_behind(tmp_path):
    assert refusal(tmp_path / 'no/folder/no.bag') == f'analyze: {tmp_path}/no/folder/no.bag: no such bag'
    (tmp_path / 'empty').mkdir()
    assert 'no bag in this folder' in refusal(tmp_path / 'empty')
    assert [path.name for path in tmp_path.rglob('*')] == ['empty']


def test_other_results_are_shown_beside(tmp_path, capsys):
    for name in ('a/0', 'b/0', 'b/1'):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        write_bag(tmp_path / f'{name}.bag', trial(number=int(name[-1])))
    analyze.main([str(tmp_path / 'a'), '--beside', str(tmp_path / 'b'), '--out', str(tmp_path / 'deep' / 'out')])
    assert (tmp_path / 'deep' / 'out' / 'report.html').is_file()
    assert '\n1 trials beside 2\n' in capsys.readouterr().out
    assert 'no such bag' in refusal(tmp_path / 'a', '--beside', tmp_path / 'c')
