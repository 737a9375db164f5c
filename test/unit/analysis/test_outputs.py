"""The files of an analysis, in a folder that has all of them or none, and only replaces an earlier analysis."""

import math
import tempfile

import pytest

from diff_encoder_sim.analysis.charts import figures
from diff_encoder_sim.analysis.outputs import CONTENTS, output_folder, ros_wheels, write_analysis
from diff_encoder_sim.analysis.report import page
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.topics import PoseSource
from trial_bags import trial, write_bag
from trial_tables import IN, OUT, cell, paper_results
from trial_tables import trial as trial_row

NONE = (0.0, 0.0, 0.0)


def test_every_file_is_written_without_a_writable_home(tmp_path, monkeypatch):
    (tmp_path / 'home').touch()
    monkeypatch.setenv('HOME', str(tmp_path / 'home'))
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    (tmp_path / 'out').mkdir()
    assert 'SL' in write_analysis(load_results([write_bag(tmp_path / 'a.bag', trial())]), tmp_path / 'out')
    files = {str(path.relative_to(tmp_path / 'out')) for path in (tmp_path / 'out').rglob('*')}
    kinds = ('fig4_xy_errors', 'fig5_distributions')
    drawn = {f'figures/{kind}_{source.value}.png' for kind in kinds for source in PoseSource}
    tables = {path.name for path in (tmp_path / 'out' / 'tables').iterdir()}
    of_goal = ('table4', 'table5', 'table6', 'table6_amcl', 'table4_minus_truth')
    names = ['table3', *(name + more for name in of_goal for more in ('', '_intervals')), 'path_errors', 'comparisons']
    of_paper = {f'table{number}.{suffix}' for number in range(3, 7) for suffix in ('md', 'tex')}
    assert tables == {*(f'{name}.csv' for name in names), *of_paper}
    assert {*drawn, 'figures/trajectories_SL.svg', 'report.html', 'ros1.yaml', 'ros2.yaml'} <= files


def test_the_papers_scores_are_lines_for_the_terminal_with_enough_trials_or_beside_others(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, 'write_figures', lambda *_: [])
    monkeypatch.setattr(page, 'trial_charts', lambda *_: None)
    made = [paper_results(cell('SL', '40', 'odom', [IN] * count)) for count in (3, 30)]
    few, enough = (each._replace(title=f'{len(each.trials)}') for each in made)
    for number, (made, beside, lines) in enumerate(((few, None, 0), (enough, None, 1), (few, enough, 2))):
        (tmp_path / f'{number}').mkdir()
        text = write_analysis(made, tmp_path / f'{number}', beside)
        assert len([line for line in text.splitlines() if 'paper' in line]) == lines
        tables = {path.name for path in (tmp_path / f'{number}' / 'tables').iterdir()}
        assert {'paper_scores.csv', 'paper_table4.tex', 'paper_cells.csv'} <= tables and 'paper_cells.md' not in tables


def write(folder, **files):
    with output_folder(folder) as made:
        for name, text in files.items():
            (made / name).write_text(text)


def names(folder):
    return sorted(path.name for path in folder.rglob('*'))


def test_an_earlier_analysis_is_replaced_unless_the_new_one_fails(tmp_path):
    out = tmp_path / 'out'
    write(out, one='1', two='2')
    write(out, one='3')
    with pytest.raises(KeyboardInterrupt), output_folder(out) as made:
        (made / 'one').write_text('4')
        raise KeyboardInterrupt
    assert names(tmp_path) == [CONTENTS, 'one', 'out'] and (out / 'one').read_text() == '3'


def test_files_of_others_are_not_overwritten(tmp_path):
    notes = tmp_path / 'deep' / 'notes.txt'
    notes.parent.mkdir()
    notes.write_text('mine')
    with pytest.raises(ConfigError, match=f"{tmp_path}: contains 'deep'"):
        write(tmp_path, one='2')
    assert names(tmp_path) == ['deep', 'notes.txt'] and notes.read_text() == 'mine'
    write(tmp_path / 'out', one='1')
    notes.rename(tmp_path / 'out' / 'notes.txt')
    with pytest.raises(ConfigError, match="out: contains 'notes.txt'"):
        write(tmp_path / 'out', one='2')
    assert (tmp_path / 'out' / 'one').read_text() == '1'


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / 'file').write_text('')
    for path in (tmp_path / 'file', tmp_path / 'file' / 'out'):
        with pytest.raises(ConfigError, match=str(path)):
            write(path, one='1')
    assert names(tmp_path) == ['file']


def test_parameters_for_ros_are_of_the_coarsest_sufficient_encoder_with_its_measured_errors():
    odometry = {'40': OUT, '90': IN, '1024': IN, '90-100': OUT}
    pairs = [(ppr, number) for ppr in odometry for number in range(20)]
    made = [trial_row('SL', ppr, number, world=NONE, odom=odometry[ppr]) for ppr, number in pairs]
    wheels = ros_wheels(paper_results(made))
    assert (wheels.odometry.ppr.plain, wheels.about) == (90, 'made for a test, 90 counts, wheels as simulated')
    variances, measurement = wheels.measured
    assert variances == pytest.approx([0.01**2, 0.02**2, math.radians(1.0) ** 2])
    assert measurement == 'SL, measured in 20 trials'
    few = ros_wheels(paper_results(made[-10:]))
    assert few.odometry.ppr.plain == {'left': 90, 'right': 100} and few.measured is None
    assert ros_wheels(paper_results(cell('SL', 'ideal', 'odom', [IN]))) is None
