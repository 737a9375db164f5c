"""Tables as the template shows them."""

from diff_encoder_sim.analysis.table import Column, Number, Table, html_table

COLUMNS = [Column('test', 'test'), Column('x', 'x [m]', '40 PPR'), Column('y', 'y [m]', '40 PPR')]


def test_numbers_are_rounded_and_missing_ones_are_dashes():
    table = html_table(Table('t', 'A table', COLUMNS, [['SL', Number(0.12345, 3), Number(None, 3)]], ['a note']))
    [block] = table.blocks
    assert [row.entries for row in block.rows] == [['SL', '0.123', '–']]
    assert [head.is_number for head in block.heads] == [False, True, True]
    assert (table.title, table.notes) == ('A table', ['a note'])


def test_groups_span_their_columns_and_the_rest_are_keys():
    [block] = html_table(Table('t', '', COLUMNS, [], [])).blocks
    assert block.groups == [('', 1), ('40 PPR', 2)] and block.keys == 1


def test_a_row_with_another_first_entry_is_set_apart():
    [block] = html_table(Table('t', '', COLUMNS[:1], [['SL'], ['SL'], ['DLD']], [])).blocks
    assert [row.is_first for row in block.rows] == [False, False, True]
