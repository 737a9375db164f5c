"""The scores as a table and in sentences."""

from diff_encoder_sim.analysis.paper.comparison import compare_with_paper
from diff_encoder_sim.analysis.paper.report_section import fit_texts, score_table, score_text
from paper_datasets import cell, dataset


def reading(tests, size=0.001):
    """The compared cells of thirty trials at 40 PPR, spread by `size` times -15 to 14."""
    rows = [(size * (number - 15),) * 3 for number in range(30)]
    return compare_with_paper(dataset(*(cell(test, '40', 'world', rows) for test in tests))).rows


def test_one_reading_has_one_row_for_each_source_and_test_and_all():
    table = score_table({'paper': reading(['SL', 'DLD'])})
    assert [row[:2] for row in table.rows] == [['/world_pose', 'SL'], ['/world_pose', 'DLD'], ['all', '']]
    assert [column.name for column in table.columns][2:] == ['compared', 'inside', 'alone', 'in_family']
    for column in range(2, 6):
        assert table.rows[2][column].value == table.rows[0][column].value + table.rows[1][column].value


def test_readings_are_side_by_side_and_what_one_has_not_is_empty():
    table = score_table({'a': reading(['SL', 'DLD']), 'b': reading(['SL'])})
    assert [column.group for column in table.columns] == ['', '', *4 * ['a'], *4 * ['b']]
    assert len({column.name for column in table.columns}) == len(table.columns)
    assert [entry.value for entry in table.rows[1][6:]] == [None] * 4


def test_rows_are_of_all_readings():
    table = score_table({'a': reading(['SL']), 'b': reading(['DLD'])})
    assert [row[1] for row in table.rows] == ['SL', 'DLD', '']


def test_the_sentences_name_the_readings_and_their_counts():
    near, far = reading(['SL', 'DLD']), reading(['SL', 'DLD'], size=10.0)
    assert score_text('near', near).startswith('near: of 24 cells of the paper ')
    assert fit_texts({'near': near}) == []
    [text] = fit_texts({'near': near, 'far': far})
    assert text.startswith(
        'Over equal trials, near fits the paper better, but by no more than chance explains'
    )  # two groups of trials
    [text] = fit_texts({'near': near, 'copy': near})
    assert 'near and copy fit the paper equally well: 0 cells agree with near alone' in text
