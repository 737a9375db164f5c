"""Nothing becomes larger than it says, nor larger than a limit, whatever compressed it."""

import bz2
import io

import lz4.frame
import pytest

from bag_bombs import BZ2_OF_TWO_GB, lz4_of_zeros, zstd_of_zeros
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.bounded_decompression import LARGEST_CHUNK, decompressed, open_zstd

BOMBS = {'bz2': lambda: BZ2_OF_TWO_GB, 'lz4': lz4_of_zeros, 'zstd': zstd_of_zeros}
CONTENT = bytes(range(256)) * 4000
SOUND = {'bz2': bz2.compress(CONTENT), 'lz4': lz4.frame.compress(CONTENT), 'none': CONTENT, '': CONTENT}


@pytest.mark.parametrize('compression', SOUND)
def test_what_is_as_large_as_it_says_is_decompressed(compression):
    for said in (len(CONTENT), LARGEST_CHUNK):
        assert decompressed(compression, SOUND[compression], said) == CONTENT


@pytest.mark.parametrize('size', [0, 1, 1 << 22])
def test_zstd(size):
    size = size // 2**22 * 2**22
    assert decompressed('zstd', zstd_of_zeros(size), size) == bytes(size)
    assert open_zstd(io.BytesIO(zstd_of_zeros(size))).read() == bytes(size)


@pytest.mark.parametrize('compression', BOMBS)
def test_what_becomes_larger_than_it_says_is_refused(compression):
    for said in (0, 1000, 1 << 20):
        with pytest.raises(InputFault, match=f'becomes larger than the {said} bytes that it says'):
            decompressed(compression, BOMBS[compression](), said)


@pytest.mark.parametrize('compression', [*BOMBS, 'none'])
def test_what_says_more_than_the_limit_is_refused_before_it_is_decompressed(compression):
    with pytest.raises(InputFault, match=f'allowed: at most {LARGEST_CHUNK}'):
        decompressed(compression, b'', LARGEST_CHUNK + 1)


@pytest.mark.parametrize('compression', BOMBS)
def test_damage_is_named_in_one_line(compression):
    with pytest.raises(InputFault, match='cannot be decompressed: .') as caught:
        decompressed(compression, b'no such thing' * 9)
    assert '\n' not in str(caught.value)


def test_an_unknown_compression_is_named():
    with pytest.raises(InputFault, match="compressed by 'xz'; expected bz2, lz4, zstd or none"):
        decompressed('xz', b'x')
