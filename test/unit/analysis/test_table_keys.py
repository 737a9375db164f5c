"""The names of cells, and the key columns of tables."""

from diff_encoder_sim.analysis.dataset import CellKey
from diff_encoder_sim.analysis.table_keys import cell_text, key_columns, key_entries, setup_text, varied_keys
from paper_datasets import IN, cell, dataset

NOISY, SLIPPING = (('noise', '0.03'),), (('slip', '0.1'),)


def test_a_cell_is_named_with_its_parameters():
    assert cell_text(CellKey('SL', '90', NOISY)) == 'SL, 90 PPR, noise 0.03'
    assert setup_text('SL', ()) == 'SL'


def test_every_varied_parameter_has_a_column_that_others_leave_empty():
    made = dataset(cell('SL', '40', 'odom', [IN], varied=NOISY), cell('SL', '40', 'odom', [IN, IN], varied=SLIPPING))
    keys = varied_keys(made)
    assert [column.name for column in key_columns(keys)] == ['test', 'noise', 'slip']
    assert key_entries('SL', SLIPPING, keys) == ['SL', '', '0.1']
