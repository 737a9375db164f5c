"""Images that are small, and that become much more than they are."""

import struct
import zlib


def png_of_zeros(width, height):
    """A greyscale image of one byte each row, repeated by the compression."""

    def part(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))

    compressor = zlib.compressobj(9)
    rows = b''.join([compressor.compress(bytes(width + 1)) for _ in range(height)]) + compressor.flush()
    head = struct.pack('>IIBBBBB', width, height, 8, 0, 0, 0, 0)
    return b'\x89PNG\r\n\x1a\n' + part(b'IHDR', head) + part(b'IDAT', rows) + part(b'IEND', b'')
