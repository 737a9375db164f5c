"""The comparison of datasets with the paper, and that nothing else depends on the paper."""

import re

import pytest

from diff_encoder_sim.analysis.paper.report_section import paper_section
from diff_encoder_sim.base.errors import ConfigError
from paper_datasets import IN, OUT, cell, paper_dataset
from places import SOURCE

ANALYSIS = SOURCE / 'diff_encoder_sim' / 'analysis'


def test_only_the_report_and_the_writing_of_files_import_the_paper():
    importers = [
        str(path.relative_to(ANALYSIS.parent))
        for path in sorted(ANALYSIS.parent.rglob('*.py'))
        if path.parent != ANALYSIS / 'paper'
        and re.search(r'import.*analysis\.paper|analysis\.paper.*import', path.read_text())
    ]
    assert importers == ['analysis/output_files.py', 'analysis/report/page.py']


def test_a_dataset_that_has_no_cell_of_the_paper_has_no_tables():
    assert paper_section([paper_dataset(cell('own', '40', 'odom', [(0.0, 0.0, 0.0)] * 3))]) is None


def test_sets_of_varied_parameters_are_readings():
    rows = [(0.0, 0.0, 0.0)] * 3
    quiet, noisy = (('lidar.noise_std', '0.01'),), (('lidar.noise_std', '0.03'),)
    section = paper_section(
        [paper_dataset(cell('SL', '40', 'odom', rows, varied=quiet), cell('SL', '40', 'odom', rows, varied=noisy))]
    )
    assert list(section.claims) == ['lidar.noise_std 0.01', 'lidar.noise_std 0.03']
    assert len({len(claims) for claims in section.claims.values()}) == 1
    assert len(section.texts) == 3 and not section.has_enough_trials


def test_another_dataset_is_a_reading_beside_the_first(tmp_path):
    first, second = (paper_dataset(cell('SL', '40', 'odom', rows * 30)) for rows in ([IN], [OUT]))
    section = paper_section([first._replace(title='a'), second._replace(title='b')])
    assert list(section.claims) == ['a', 'b'] and section.has_enough_trials
    assert {row[0] for row in section.all_cells.rows} == {'a', 'b'}
    same = paper_section([first._replace(folder=tmp_path / 'a'), second._replace(folder=tmp_path / 'b')])
    assert list(same.claims) == [f'{tmp_path}/a', f'{tmp_path}/b']


def test_the_better_fit_is_of_the_trials_that_both_have():
    """With fewer trials less is contradicted, which is no better fit."""
    few, many = (paper_dataset(cell('SL', '40', 'odom', [OUT] * count)) for count in (3, 30))
    [few_score, many_score, fit] = paper_section([few._replace(title='few'), many._replace(title='many')]).texts
    assert few_score.partition(':')[2] != many_score.partition(':')[2]
    assert 'few and many fit the paper equally well: 0 cells agree with few alone, 0 with many alone' in fit
    [_, _, *fits] = paper_section([few, many._replace(trials=many.trials[10:])]).texts
    assert fits == []


def test_another_dataset_must_have_cells_of_the_paper():
    has, has_not = (paper_dataset(cell(test, '40', 'odom', [IN] * 3)) for test in ('SL', 'own'))
    for pair in ([has, has_not], [has_not, has]):
        with pytest.raises(
            ConfigError, match=r"has no cell of the paper; expected the paper's robot and tests \(SL, SMT or DLD"
        ):
            paper_section(pair)
