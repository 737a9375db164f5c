"""trials.csv on its own: rows in, rows out, torn and foreign lines."""

import pytest

from campaign_files import NOISE, refusal, row_of_job, run
from diff_encoder_sim.trials.results import TrialsTable


@pytest.fixture(name='rows')
def fixture_rows(campaign):
    return [row_of_job(campaign, job, 'bags/x.bag') for job in campaign.trials()]


def test_what_is_appended_reads_back_with_its_line(tmp_path, rows):
    table = TrialsTable(tmp_path / 'trials.csv', [NOISE])
    assert list(table.rows()) == []
    table.write(rows[:2])
    with table.open():
        for row in rows[2:]:
            table.append(row)
            assert list(table.rows())[-1][1] == row
    assert list(table.rows()) == list(enumerate(rows, start=2))


def test_a_torn_line_is_no_line(tmp_path, rows):
    table = TrialsTable(tmp_path / 'trials.csv', [NOISE])
    table.write(rows[:2])
    content = table.path.read_bytes()
    table.path.write_bytes(content[:-1])
    assert [row for _, row in table.rows()] == rows[:1]


@pytest.mark.parametrize(
    'damage',
    [
        lambda lines: [*lines[:2], b'SL,40,0.01,1', *lines[3:]],
        lambda lines: [*lines, b'x'],
        lambda lines: [*lines, lines[2].replace(b'SL', b'XX')],
        lambda lines: [*lines, b'\0' * 30],
        lambda lines: [*lines, b'\xff\xfe'],
        lambda lines: [*lines, b''],
        lambda lines: [*lines, b'"'],
        lambda lines: [*lines, lines[1].replace(b'bags/', b'/etc/')],
        lambda lines: [*lines, lines[1].replace(b',1,1,', b',1,2,')],
        lambda lines: [lines[0].replace(b'_rad', b'_deg'), *lines[1:]],
    ],
)
def test_a_table_that_somebody_damaged_is_named_with_its_line_and_left_alone(campaign, tmp_path, damage):
    folder = tmp_path / 'out'
    lines = run(campaign, folder).splitlines()
    content = b'\n'.join([*damage(lines), b''])
    (folder / 'trials.csv').write_bytes(content)
    assert 'trials.csv: line ' in refusal(folder, campaign)
    assert (folder / 'trials.csv').read_bytes() == content
