"""All tables of a dataset, and their files."""

from diff_encoder_sim.analysis.table import write_tables
from diff_encoder_sim.analysis.tables import all_tables
from synthetic_trials import dataset_of, synthetic_dataset


def test_table_3_leaves_encoders_without_one_ppr_out():
    tables = {table.name: table for table in all_tables(synthetic_dataset(pprs=('90', 'ideal', '90-1024'), trials=1))}
    assert [row[0] for row in tables['table3'].rows] == ['90']


def written(folder, *tables, csv_only=()):
    """Contents of the files, by name."""
    write_tables(tables, csv_only, folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_files_of_a_dataset(tmp_path):
    files = written(tmp_path / 'analysis' / 'tables', *all_tables(synthetic_dataset(trials=3)))
    names = [
        'table3',
        *(
            name + more
            for name in ('table4', 'table5', 'table6', 'table6_amcl', 'table4_minus_truth')
            for more in ('', '_intervals')
        ),
    ]
    assert sorted(files) == sorted(f'{name}.{suffix}' for name in names for suffix in ('csv', 'md', 'tex'))
    assert all(files.values())


def test_the_same_dataset_gives_the_same_bytes(tmp_path):
    first, second = (written(tmp_path / name, *all_tables(synthetic_dataset(trials=4))) for name in 'ab')
    assert first == second


def test_tables_of_no_trials_are_empty(tmp_path):
    tables = all_tables(dataset_of([]))
    assert all(table.rows == [] for table in tables)
    assert len(written(tmp_path, *tables)) == 3 * len(tables)
