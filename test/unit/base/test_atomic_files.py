"""Files that are either complete or absent."""

import os

import pytest

from diff_encoder_sim.base import atomic_files
from diff_encoder_sim.base.atomic_files import write_file


def test_a_file_is_written_and_replaced(tmp_path):
    for content in (b'one', b''):
        write_file(tmp_path / 'a', content)
        assert (tmp_path / 'a').read_bytes() == content
    assert os.listdir(str(tmp_path)) == ['a']


@pytest.mark.parametrize('call', ['fsync', 'replace'])
def test_a_failure_leaves_the_old_file_and_names_it(tmp_path, monkeypatch, call):
    path = tmp_path / 'a'
    path.write_bytes(b'old')

    def fail(*_):
        raise OSError(28, 'No space left on device', 'another name')

    monkeypatch.setattr(atomic_files.os, call, fail)
    with pytest.raises(OSError, match='No space left on device') as caught:
        write_file(path, b'new')
    assert caught.value.filename == str(path)
    assert os.listdir(str(tmp_path)) == ['a'] and path.read_bytes() == b'old'
