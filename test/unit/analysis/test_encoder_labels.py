"""Labels of encoders."""

import pytest

from diff_encoder_sim.analysis.encoder_labels import encoders_text, ppr_order, ppr_value, ppr_values


def test_a_label_is_a_number_if_both_wheels_have_it():
    labels = ('1024', '1632.67 pololu_25d', '90-1024', 'ideal')
    assert [ppr_value(label) for label in labels] == [1024, 1632.67, None, None]
    assert ppr_values(['ideal', '90-1024', '1024', '40', '40', '40 sen_speed']) == [40.0, 1024.0]


def test_encoders_are_ascending_then_unequal_wheels_then_none():
    ascending = ['40', '1632.67 pololu_25d', '4096', '4096 as5600', '4096 xl430', '8192 amt102', '90-1024', 'ideal']
    assert sorted([*ascending[4:], *ascending[:4]], key=ppr_order) == ascending


@pytest.mark.parametrize(
    ('labels', 'text'),
    [
        (['40'], '40 counts'),
        (['40', '90', '1024'], '40, 90 and 1024 counts'),
        (['40', 'ideal'], '40 counts and ideal odometry'),
        (['40', '4096 xl430', '8192 amt102'], '40 counts, xl430 (4096 counts) and amt102 (8192 counts)'),
    ],
)
def test_the_unit_is_written_once(labels, text):
    assert encoders_text(labels) == text
