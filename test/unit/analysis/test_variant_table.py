"""The table of a campaign's variants."""

from diff_encoder_sim.analysis.table import rounded
from diff_encoder_sim.analysis.tables import all_tables, variant_table
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import dataset, trial
from synthetic_trials import synthetic_dataset

WORLD = (0.0, 0.0, 0.0)


def cell(ppr, name, size_m, trials=6, **others):
    return [
        trial('SL', ppr, number, varied=(('variant', name),), world=WORLD, odom=(size_m * number, 0.0, 1.0), **others)
        for number in range(1, trials + 1)
    ]


def test_rows_are_variants_and_columns_encoders():
    lost = cell('8192 amt102', 'restart', 2.0, outcome=Outcome.LOST)
    table = variant_table(dataset(cell('40', 'none', 0.1), cell('40', 'restart', 0.4), lost))
    assert [column.name for column in table.columns] == [
        *('test', 'variant', 'error'),
        *(f'ppr40_{head}' for head in ('median', 'quartiles', 'ratio', '95_%', 'failed')),
        *(f'ppr8192_amt102_{head}' for head in ('median', 'quartiles', 'ratio', '95_%', 'failed')),
    ]
    assert {column.group for column in table.columns[3:]} == {'40 PPR', 'amt102 (8192 counts)'}
    texts = [[rounded(entry, '-') for entry in row] for row in table.rows]
    assert texts[0] == ['SL', 'none', 'position [mm]', '350.00', '250.00', '-', '', '0', '-', '-', '-', '', '-']
    assert texts[2][:8] == ['SL', 'restart', 'position [mm]', '1400.00', '1000.00', '4.00', '4 to 4', '0']
    assert texts[2][8:] == ['7000.00', '5000.00', '-', '', '6']
    assert [row[2] for row in texts] == ['position [mm]', 'heading [deg]'] * 2


def test_few_trials_have_no_interval():
    table = variant_table(dataset(cell('40', 'none', 0.1, 2), cell('40', 'restart', 0.4, 2)))
    assert [rounded(entry, '-') for entry in table.rows[2][5:7]] == ['4.00', '']


def test_it_is_among_the_tables_where_there_are_variants():
    assert all_tables(dataset(cell('40', 'none', 0.1)))[-1].name == 'variants'
    without = synthetic_dataset(tests=('SL',), pprs=('40',), trials=2)
    assert 'variants' not in [table.name for table in all_tables(without)]
