"""The table of checks."""

from diff_encoder_sim.simulation.self_check import Check, checks_table


def test_the_table_says_what_is_not_ok_and_below_it_what_to_do():
    table = checks_table([Check('pitch', 'level', True, ''), Check('torque', '40 %', False, 'stronger motors')])
    assert table.splitlines()[2:] == ['pitch    level    ok', 'torque   40 %     NOT OK', '', 'torque: stronger motors']


def test_a_table_without_advice_ends_with_its_last_row():
    assert checks_table([Check('pitch', 'level', True, '')]).splitlines()[-1].endswith('ok')
