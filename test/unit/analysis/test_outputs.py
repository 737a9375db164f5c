"""The files of an analysis."""

from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.analysis.outputs import write_analysis
from trial_bags import trial, write_bag


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
