"""Nothing becomes larger than it says, nor larger than a limit, whatever compressed it."""

import bz2

import lz4.frame
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.bounded_decompression import LARGEST_CHUNK, decompressed

CONTENT = bytes(range(256)) * 4000
SOUND = {'bz2': bz2.compress(CONTENT), 'lz4': lz4.frame.compress(CONTENT), 'none': CONTENT, '': CONTENT}


@pytest.mark.parametrize('compression', SOUND)
def test_what_is_as_large_as_it_says_is_decompressed(compression):
    for said in (len(CONTENT), LARGEST_CHUNK):
        assert decompressed(compression, SOUND[compression], said) == CONTENT


@pytest.mark.parametrize(
    ('compression', 'content', 'said', 'complaint'),
    [
        ('bz2', SOUND['bz2'], 1000, 'larger than the 1000 bytes'),
        ('lz4', SOUND['lz4'], 1000, 'larger than the 1000 bytes'),
        ('bz2', b'', LARGEST_CHUNK + 1, f'allowed: at most {LARGEST_CHUNK}'),
        ('zstd', b'no such thing', LARGEST_CHUNK, 'cannot be decompressed: .'),
        ('xz', b'x', LARGEST_CHUNK, "compressed by 'xz'; expected bz2, lz4, zstd or none"),
    ],
)
def test_what_cannot_be_decompressed_is_refused(compression, content, said, complaint):
    with pytest.raises(InputFault, match=complaint):
        decompressed(compression, content, said)
