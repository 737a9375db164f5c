"""Labels of encoders."""

import pytest

from diff_encoder_sim.analysis.encoder_labels import encoders_text, ppr_order, ppr_text, ppr_value, ppr_values

LABELS = ['ideal', '90-1024', '1024', '40']


def test_a_label_is_a_number_where_both_wheels_have_it():
    assert (ppr_value('1024'), ppr_value('90-1024'), ppr_value('ideal')) == (1024.0, None, None)
    assert ppr_values([*LABELS, '40', '40 sen_speed']) == [40.0, 1024.0]
    assert ppr_value('1632.67 pololu_25d') == 1632.67


def test_encoders_are_ascending_then_unequal_wheels_then_none():
    assert sorted(LABELS, key=ppr_order) == ['40', '1024', '90-1024', 'ideal']
    real = ['4096 xl430', '8192 amt102', '4096 as5600', '1632.67 pololu_25d']
    ascending = ['1632.67 pololu_25d', '4096', '4096 as5600', '4096 xl430', '8192 amt102', 'ideal']
    assert sorted([*real, '4096', 'ideal'], key=ppr_order) == ascending
    assert [ppr_text(label) for label in LABELS[-2:]] == ['1024 PPR', '40 PPR']


@pytest.mark.parametrize(
    ('labels', 'text'),
    [
        (['40'], '40 PPR'),
        (['40', '90', '1024'], '40, 90 and 1024 PPR'),
        (['40', 'ideal'], '40 PPR and ideal odometry'),
        (['40', '4096 xl430', '8192 amt102'], '40 PPR, xl430 (4096 counts) and amt102 (8192 counts)'),
    ],
)
def test_the_unit_stands_once(labels, text):
    assert encoders_text(labels) == text
