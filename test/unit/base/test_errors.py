"""The text of a library's error."""

import pytest

from diff_encoder_sim.base.errors import in_one_line


@pytest.mark.parametrize(
    ('error', 'line'),
    [(ValueError('one\n  two\tthree'), 'one two three'), (MemoryError(), 'MemoryError'), (KeyError('a'), "'a'")],
)
def test_any_error_is_one_line(error, line):
    assert in_one_line(error) == line
