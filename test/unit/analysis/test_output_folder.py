"""The folder of an analysis: all of it or nothing, and only over an earlier analysis."""

import pytest

from diff_encoder_sim.analysis.output_folder import CONTENTS, output_folder
from diff_encoder_sim.base.errors import ConfigError


def write(folder, **files):
    with output_folder(folder) as made:
        for name, text in files.items():
            (made / name).write_text(text)


def names(folder):
    return sorted(path.name for path in folder.rglob('*'))


def test_an_earlier_analysis_is_replaced(tmp_path):
    out = tmp_path / 'out'
    write(out, one='1', two='2')
    write(out, one='3')
    assert names(tmp_path) == [CONTENTS, 'one', 'out'] and (out / 'one').read_text() == '3'


@pytest.mark.parametrize('earlier', [False, True])
def test_what_others_wrote_is_not_overwritten(tmp_path, earlier):
    out = tmp_path / 'out'
    if earlier:
        write(out, one='1')
    (out / 'deep').mkdir(parents=True)
    (out / 'deep' / 'notes.txt').write_text('mine')
    before = names(tmp_path)
    with pytest.raises(ConfigError, match=f"{out}: holds 'deep', which analyze did not write"):
        write(out, one='2')
    assert names(tmp_path) == before and (out / 'deep' / 'notes.txt').read_text() == 'mine'


def test_a_failed_analysis_leaves_the_earlier_one(tmp_path):
    write(tmp_path / 'out', one='1')
    with pytest.raises(KeyboardInterrupt), output_folder(tmp_path / 'out') as made:
        (made / 'one').write_text('2')
        raise KeyboardInterrupt
    assert (tmp_path / 'out' / 'one').read_text() == '1' and names(tmp_path) == [CONTENTS, 'one', 'out']


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / 'file').write_text('')
    for path in (tmp_path / 'file', tmp_path / 'file' / 'out'):
        with pytest.raises(ConfigError, match=str(path)) as caught:
            write(path, one='1')
        assert '\n' not in str(caught.value)
    assert names(tmp_path) == ['file']
