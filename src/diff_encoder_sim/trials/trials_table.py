"""trials.csv of a results folder: written a line at a time, so that a kill loses no finished trial."""

from __future__ import annotations

import contextlib
import io
import os
from pathlib import Path
from typing import Iterable, Iterator, Optional, Sequence, Tuple

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.trial_row import TrialRow, csv_fields, csv_line, fields_of, header, row_of


class TrialsTable:
    """A file with a header, and a line for each finished trial.

    A line is written in one call and its end comes last: a line without end is torn, and ignored.
    """

    def __init__(self, path: Path, varied_keys: Sequence[str]) -> None:
        self.path = path
        self._varied_keys = varied_keys
        self._file: Optional[io.FileIO] = None

    def rows(self) -> Iterator[Tuple[int, TrialRow]]:
        """Read the whole lines, with their numbers from 1; nothing where there is no file.

        Raises:
            ConfigError: a line is no row, or the first neither that nor the header.
            OSError: the file cannot be read.
        """
        content = self.path.read_bytes() if self.path.is_file() else b''
        head = csv_line(header(self._varied_keys)).rstrip()
        for number, line in enumerate(content[: content.rfind(b'\n') + 1].splitlines(), start=1):
            if number == 1 and line == head:
                continue
            try:
                row = row_of(csv_fields(line), self._varied_keys)
            except (ValueError, KeyError):
                raise self.foreign_line(number) from None
            yield number, row

    def foreign_line(self, number: int) -> ConfigError:
        """Make the error for a line that is not of this campaign."""
        expected = 'expected the file as campaign wrote it, or without this line, whose trial is then run again'
        return ConfigError(f'{self.path}: line {number} does not belong to this campaign; {expected}')

    def write(self, rows: Iterable[TrialRow]) -> None:
        """Replace the file, whole or not at all."""
        lines = [header(self._varied_keys), *map(fields_of, rows)]
        write_file(self.path, b''.join(map(csv_line, lines)))

    def open(self) -> io.FileIO:
        """Open the file for `append`."""
        self._file = io.FileIO(str(self.path), 'ab')
        return self._file

    def append(self, row: TrialRow) -> None:
        """Add a line; it is on the disk when this returns. After an error the lines before are whole.

        Raises:
            OSError: the disk is full, or the like.
        """
        if self._file is None:
            raise ValueError(f'{self.path}: not open')
        size = os.fstat(self._file.fileno()).st_size
        try:
            _write_all(self._file, csv_line(fields_of(row)))
        except OSError:
            with contextlib.suppress(OSError):
                self._file.truncate(size)
            raise


def _write_all(file: io.FileIO, content: bytes) -> None:
    while content:
        content = content[file.write(content) :]
    os.fsync(file.fileno())
