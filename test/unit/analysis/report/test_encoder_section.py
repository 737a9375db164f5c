"""The report's table of a campaign's real encoders."""

import pytest

from diff_encoder_sim.analysis.report.origin import encoder_section
from synthetic_trials import synthetic_dataset

AMT102 = {
    'label': '8192 amt102',
    'name': 'AMT102-V',
    'source': ['datasheet', 'manual'],
    'price': 'industrial',
    'resolution': '2048 lines x 4 = 8192 counts per wheel revolution',
    'counts_per_metre': 13037.97,
}


def dataset(**manifest):
    return synthetic_dataset(tests=('SL',), pprs=('40',), trials=1)._replace(manifest=manifest)


def test_each_encoder_is_a_row_with_what_its_counts_follow_from():
    [block] = encoder_section(dataset(encoders=[AMT102])).blocks
    [row] = block.rows
    resolution, source = AMT102['resolution'], 'datasheet; manual'
    assert row.entries == ['amt102 (8192 counts)', 'AMT102-V', 'industrial', resolution, '13038.0', source]


@pytest.mark.parametrize('manifest', [{}, {'encoders': {}}, {'encoders': [{}]}, {'encoders': ['a']}])
def test_there_is_none_without_encoders_nor_in_an_edited_manifest(manifest):
    assert encoder_section(dataset(**manifest)) is None
