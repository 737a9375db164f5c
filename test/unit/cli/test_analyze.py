"""The command: what it prints, where it writes, and what it never overwrites."""

import pytest

from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.analysis.output_folder import CONTENTS, output_folder
from diff_encoder_sim.analysis.outputs import write_analysis
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli import analyze
from trial_bags import TRUTH, trial, write_bag


@pytest.fixture(autouse=True)
def fixture_quick(monkeypatch):
    """Files that take no time to make."""

    def write_analysis(dataset, folder):
        (folder / 'report.html').write_text(dataset.title)
        return f'{len(dataset.trials)} trials'

    monkeypatch.setattr(analyze, 'write_analysis', write_analysis)


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
    assert row == ['SL', '40', '3', '3', '0', '0.0000', '67', '0.0200']  # odom and world; the others are silent


def test_what_is_wrong_is_said_and_the_rest_is_analysed(tmp_path, capsys, caplog):
    write_bag(tmp_path / 'a.bag', trial())
    (tmp_path / 'b.bag').write_bytes(b'')
    analyze.main([str(tmp_path)])
    assert [record.message.split(': ')[0] for record in caplog.records] == [f'{tmp_path}/b.bag']
    assert 'succeeded' in capsys.readouterr().out


def test_nothing_to_analyse_is_one_line_and_leaves_nothing_behind(tmp_path):
    for name in ('no.bag', 'no/folder/no.bag'):
        assert refusal(tmp_path / name) == f'analyze: {tmp_path / name}: no such bag'
    (tmp_path / 'empty').mkdir()
    assert 'no .bag file in this folder' in refusal(tmp_path / 'empty')
    assert [path.name for path in tmp_path.rglob('*')] == ['empty']


def test_the_output_is_where_it_is_wanted(tmp_path):
    bag = write_bag(tmp_path / 'a.bag', trial())
    analyze.main([str(bag)])
    assert (tmp_path / 'analysis' / 'report.html').is_file()
    analyze.main([str(bag), '--out', str(tmp_path / 'deep' / 'out')])
    assert (tmp_path / 'deep' / 'out' / 'report.html').read_text() == 'a'


def test_the_help_has_an_example(capsys):
    with pytest.raises(SystemExit) as caught:
        analyze.main(['--help'])
    assert caught.value.code == 0 and 'analyze results/paper' in capsys.readouterr().out


def test_every_file_is_written(tmp_path):
    dataset = load_dataset([write_bag(tmp_path / 'a.bag', trial())])
    (tmp_path / 'out').mkdir()
    assert 'SL' in write_analysis(dataset, tmp_path / 'out')
    files = {str(path.relative_to(tmp_path / 'out')) for path in (tmp_path / 'out').rglob('*')}
    assert {
        'tables/table4.tex',
        'tables/path_errors.md',
        'tables/comparisons.csv',
        'figures/trajectories_SL.svg',
        'report.html',
    } <= files
    assert 'tables/comparisons.md' not in files


# ---- the output folder


def write(folder, **files):
    with output_folder(folder) as made:
        for name, text in files.items():
            (made / name).write_text(text)


def names(folder):
    return sorted(path.name for path in folder.rglob('*'))


def test_an_earlier_analysis_is_replaced(tmp_path):
    out = tmp_path / 'out'
    write(out, one='1', two='2')
    write(out, one='3')
    assert names(tmp_path) == [CONTENTS, 'one', 'out'] and (out / 'one').read_text() == '3'


def test_an_empty_folder_and_a_link_to_one_are_written(tmp_path):
    (tmp_path / 'out').mkdir()
    (tmp_path / 'link').symlink_to('out')
    write(tmp_path / 'link', one='1')
    assert (tmp_path / 'link').is_symlink() and (tmp_path / 'out' / 'one').read_text() == '1'
    write(tmp_path / 'out', one='2')
    assert names(tmp_path / 'out') == [CONTENTS, 'one']


@pytest.mark.parametrize('earlier', [False, True])
def test_what_others_wrote_is_not_overwritten(tmp_path, earlier):
    out = tmp_path / 'out'
    if earlier:
        write(out, one='1')
    (out / 'deep').mkdir(parents=True)
    (out / 'deep' / 'notes.txt').write_text('mine')
    before = names(tmp_path)
    with pytest.raises(ConfigError, match=f"{out}: holds 'deep', which analyze did not write"):
        write(out, one='2')
    assert names(tmp_path) == before and (out / 'deep' / 'notes.txt').read_text() == 'mine'


def test_a_failed_analysis_leaves_the_earlier_one(tmp_path):
    write(tmp_path / 'out', one='1')
    with pytest.raises(KeyboardInterrupt), output_folder(tmp_path / 'out') as made:
        (made / 'one').write_text('2')
        raise KeyboardInterrupt
    assert (tmp_path / 'out' / 'one').read_text() == '1' and names(tmp_path) == [CONTENTS, 'one', 'out']


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / 'file').write_text('')
    for path in (tmp_path / 'file', tmp_path / 'file' / 'out'):
        with pytest.raises(ConfigError, match=str(path)) as caught:
            write(path, one='1')
        assert '\n' not in str(caught.value)
    assert names(tmp_path) == ['file']
