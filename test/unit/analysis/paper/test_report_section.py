"""The comparison of datasets with the paper, and that nothing else depends on the paper."""

import re

import pandas as pd
import pytest

from diff_encoder_sim.analysis.paper.comparison import compare_with_paper
from diff_encoder_sim.analysis.paper.report_section import cell_tables, paper_section, resolution_table, score_table
from diff_encoder_sim.base.errors import ConfigError
from places import SOURCE
from trial_tables import IN, OUT, cell, paper_results, results_of

ANALYSIS = SOURCE / 'diff_encoder_sim' / 'analysis'


def test_only_the_report_and_the_writing_of_files_import_the_paper():
    importers = [
        str(path.relative_to(ANALYSIS.parent))
        for path in sorted(ANALYSIS.parent.rglob('*.py'))
        if path.parent != ANALYSIS / 'paper'
        and re.search(r'import.*analysis\.paper|analysis\.paper.*import', path.read_text())
    ]
    assert importers == ['analysis/outputs.py', 'analysis/report/page.py']


def test_another_dataset_is_a_reading_beside_the_first_if_both_have_cells_of_the_paper(tmp_path):
    given = (('SL', IN), ('SL', OUT), ('own', IN))
    first, second, own = (paper_results(cell(test, '40', 'odom', [error] * 30)) for test, error in given)
    section = paper_section([first._replace(title='a'), second._replace(title='b')])
    assert list(section.claims) == ['a', 'b'] and section.has_enough_trials
    assert set(section.all_cells.exact['campaign']) == {'a', 'b'}
    same = paper_section([first._replace(folder=tmp_path / 'a'), second._replace(folder=tmp_path / 'b')])
    assert list(same.claims) == [f'{tmp_path}/a', f'{tmp_path}/b']
    assert paper_section([own]) is None
    for pair in ([first, own], [own, first]):
        with pytest.raises(ConfigError, match='has no cell of the paper'):
            paper_section(pair)


def reading(name, tests, size=0.001):
    """The compared cells of thirty trials at 40 PPR, spread by `size` times -15 to 14."""
    rows = [(size * (number - 15),) * 3 for number in range(30)]
    made = results_of(*(cell(test, '40', 'world', rows) for test in tests))
    return compare_with_paper(made.trials.assign(campaign=name))


def test_scores_are_by_source_and_test_and_next_to_each_other():
    table = score_table(pd.concat([reading('a', ['SL', 'DLD']), reading('b', ['SL'], size=10.0)], ignore_index=True))
    cells = [('/world_pose', 'SL'), ('/world_pose', 'DLD'), ('all', '')]
    assert list(zip(table.exact['source'], table.exact['test'])) == cells
    assert list(table.exact.columns[2:]) == ['a_compared', 'a_agree', 'b_compared', 'b_agree']
    (a, a_agree, b, b_agree), (_, _, none, _), (total, total_agree, *_) = table.exact.iloc[:, 2:].values.tolist()
    assert a == b == 12 and total == 24 and none is None and b_agree < a_agree <= total_agree <= total


def test_table_3_agrees_with_the_print_except_its_error():
    made = results_of(*(cell('SL', ppr, 'odom', [IN]) for ppr in ('4096', '1024', '40', '90', '128', '90-1024')))
    rows = resolution_table(made).exact.set_index('ppr')
    assert list(rows.index) == ['40', '90', '128', '1024', '4096']
    for ppr, row in rows.drop(index='128').iterrows():
        assert row['angle_ours'] == pytest.approx(row['angle_paper'], rel=0.025)
        assert (abs(row['linear_paper'] / row['linear_ours'] - 1.0) > 0.025) == (ppr == '90')
    assert rows.loc['128', ['linear_paper', 'angle_paper']].isna().all()


def tables_of(*names):
    """Table 4 of cells (campaign, test, PPR), by quantity."""
    rows = [(0.0, 0.2 * (-1) ** number, 1.0) for number in range(30)]
    made = results_of(*(cell(test, ppr, 'odom', rows, campaign=name) for name, test, ppr in names), varied=['campaign'])
    return cell_tables(compare_with_paper(made.trials))[0].exact.set_index('quantity')


def test_differences_errata_and_calibrated_numbers_are_marked():
    given = (('SL', '4096'), ('SL', '1024'), ('SMT', '40'))
    of_sl, of_1024, of_smt = (tables_of(('', *name)).loc for name in given)
    assert of_sl['y [m]', 'std_printed'] == '0.033'
    assert of_sl['y [m]', 'std_ours'] == '0.203 (0.162 to 0.273) *'  # not tested
    assert of_1024['y [m]', 'std_ours'] == '0.203 (0.162 to 0.273) ≠'
    assert of_smt['yaw [deg]', 'std_printed'].endswith(' †')


def test_campaigns_are_side_by_side_without_intervals():
    table = tables_of(('paper', 'SL', '40'), ('b', 'SL', '90'))
    assert list(table['cell']) == 3 * ['SL, 40 PPR'] + 3 * ['SL, 90 PPR']
    assert tuple(table[['std_paper', 'std_b']].iloc[1]) == ('0.203', '–')
