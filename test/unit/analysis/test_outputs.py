"""The files of an analysis."""

import os
import tempfile

import pytest

from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.analysis.outputs import write_analysis
from paper_datasets import IN, cell, paper_dataset
from trial_bags import trial, write_bag


def test_every_file_is_written(tmp_path):
    dataset = load_dataset([write_bag(tmp_path / 'a.bag', trial())])
    (tmp_path / 'out').mkdir()
    assert 'SL' in write_analysis(dataset, tmp_path / 'out')
    files = {str(path.relative_to(tmp_path / 'out')) for path in (tmp_path / 'out').rglob('*')}
    assert {
        'tables/table4.tex',
        'tables/path_errors.csv',
        'tables/comparisons.csv',
        'figures/trajectories_SL.svg',
        'report.html',
    } <= files
    # The bag's drive is none of the paper's.
    assert not {'tables/comparisons.md', 'tables/paper_scores.md', 'tables/paper_cells.csv'} & files


@pytest.mark.heavy
def test_the_papers_scores_are_lines_for_the_terminal_with_enough_trials_or_beside_others(tmp_path):
    few, enough = (
        paper_dataset(cell('SL', '40', 'odom', [IN] * count))._replace(title=f'{count}') for count in (3, 30)
    )
    for number, (made, beside, lines) in enumerate(((few, None, 0), (enough, None, 1), (few, enough, 2))):
        (tmp_path / f'{number}').mkdir()
        text = write_analysis(made, tmp_path / f'{number}', beside)
        assert len([line for line in text.splitlines() if 'paper' in line]) == lines
        tables = {path.name for path in (tmp_path / f'{number}' / 'tables').iterdir()}
        assert {'paper_scores.csv', 'paper_table4.tex', 'paper_cells.csv'} <= tables and 'paper_cells.md' not in tables


def test_matplotlib_has_a_folder_where_home_cannot_be_written(tmp_path, monkeypatch):
    (tmp_path / 'home').touch()
    monkeypatch.setenv('HOME', str(tmp_path / 'home'))
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    monkeypatch.delenv('MPLCONFIGDIR', raising=False)
    dataset = load_dataset([write_bag(tmp_path / 'a.bag', trial())])
    (tmp_path / 'out').mkdir()
    write_analysis(dataset, tmp_path / 'out')
    assert os.environ['MPLCONFIGDIR'] == str(tmp_path / f'diff_encoder_sim-{os.geteuid()}' / 'matplotlib')
