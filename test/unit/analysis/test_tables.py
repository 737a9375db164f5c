"""All tables of a dataset, and their files."""

from diff_encoder_sim.analysis.table import write_tables
from diff_encoder_sim.analysis.tables import all_tables
from synthetic_trials import dataset_of, synthetic_dataset


def written(folder, tables):
    """Contents of the files, by name."""
    write_tables(tables, folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_table_3_leaves_encoders_without_one_ppr_out():
    tables = {table.name: table for table in all_tables(synthetic_dataset(pprs=('90', 'ideal', '90-1024'), trials=1))}
    assert [row[0] for row in tables['table3'].rows] == ['90']


def test_files_of_a_dataset_are_the_same_each_time(tmp_path):
    files, again = (written(tmp_path / name / 'tables', all_tables(synthetic_dataset(trials=3))) for name in 'ab')
    of_goal = ('table4', 'table5', 'table6', 'table6_amcl', 'table4_minus_truth')
    names = ['table3', *(name + more for name in of_goal for more in ('', '_intervals'))]
    in_full = [f'table{number}.{suffix}' for number in range(3, 7) for suffix in ('md', 'tex')]
    assert sorted(files) == sorted([f'{name}.csv' for name in names] + in_full)
    assert all(files.values()) and files == again


def test_tables_of_no_trials_are_empty(tmp_path):
    tables = all_tables(dataset_of([]))
    assert all(table.rows == [] for table in tables) and written(tmp_path, tables)
