"""The results folder of a campaign: manifest.json, trials.csv, bags/. It survives any kill."""

from __future__ import annotations

import contextlib
import fcntl
import io
import json
import logging
import os
from pathlib import Path
from types import TracebackType
from typing import Any, Dict, Iterator, List, Optional, Tuple, Type, Union

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX, write_file
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.campaign.campaign_definition import Campaign, TrialJob
from diff_encoder_sim.campaign.folder import BAGS, LOCK, MANIFEST, TABLE
from diff_encoder_sim.campaign.manifest import differences, manifest_of
from diff_encoder_sim.campaign.trial_row import TrialRow, csv_fields, csv_line, fields_of, header, row_of
from diff_encoder_sim.encoders.pulses import ppr_label

log = logging.getLogger(__name__)

DIFFERENCES_SHOWN = 3


class ResultStore:
    """One campaign's results, locked by one process; a context manager, which releases them at its end.

    A trial is done when its line in trials.csv is complete; without a line, or with half of one, it is pending.
    """

    def __init__(
        self, folder: Union[str, Path], campaign: Campaign, run: Dict[str, Any], must_resume: bool = False
    ) -> None:
        """Begin a folder, or resume one.

        Args:
            folder: created where there is none.
            campaign: whose results the folder holds; a folder with those of another is an error.
            run: from `manifest.describe_run`.
            must_resume: whether a folder without results is an error.

        Raises:
            ConfigError: the folder has other things in it or cannot be used.
        """
        self.folder = Path(folder)
        self._campaign = campaign
        self._varied_keys = sorted(campaign.params.vary)
        self._jobs = _jobs_by_identity(campaign)
        self._rows: Dict[int, TrialRow] = {}  # by index of job
        with contextlib.ExitStack() as opened, _named_errors(self.folder):
            self._refuse_foreign(must_resume)
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock(opened)
            self._refuse_foreign(must_resume)  # again, now that nobody else writes here
            self._begin_or_resume(run)
            self._table = opened.enter_context(open(self.folder / TABLE, 'ab', buffering=0))
            self._opened = opened.pop_all()

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        self._opened.close()

    @property
    def rows(self) -> List[TrialRow]:
        """The finished trials in the order of jobs."""
        return [self._rows[index] for index in sorted(self._rows)]

    def pending(self) -> List[TrialJob]:
        """Return the trials that are still to be run."""
        return [job for job in self._jobs.values() if job.index not in self._rows]

    def bag_path(self, job: TrialJob) -> str:
        """Return the path of a job's bag below the folder; '' when bags are not recorded."""
        is_recorded = self._campaign.params.record != 'none'
        return f'{BAGS}/{self._campaign.bag_name(job)}' if is_recorded else ''

    def append(self, row: TrialRow) -> None:
        """Write a finished trial to the disk; a second row of the same trial is dropped.

        Raises:
            ConfigError: the disk is full, or the like; the rows before are whole.
        """
        job = self._jobs[row.identity()]
        if job.index in self._rows:
            return
        path = self.folder / TABLE
        with _named_errors(path):
            size = os.fstat(self._table.fileno()).st_size
            try:
                _write_all(self._table, csv_line(fields_of(row)))
            except OSError:
                with contextlib.suppress(OSError):
                    self._table.truncate(size)
                raise
        self._rows[job.index] = row

    def finish(self) -> Path:
        """Sort trials.csv in the order of jobs, close it, and return its path.

        Raises:
            ConfigError: it cannot be written; the unsorted one is still there.
        """
        path = self.folder / TABLE
        self._table.close()
        with _named_errors(path):
            self._write_table()
        return path

    # ---- opening

    def _refuse_foreign(self, must_resume: bool) -> None:
        has_manifest = (self.folder / MANIFEST).is_file()
        if must_resume and not has_manifest:
            raise ConfigError(
                f'{self.folder}: nothing to resume: no {MANIFEST}; allowed: a folder with results, or no --resume'
            )
        if has_manifest or not self.folder.exists():
            return
        others = sorted(
            path.name for path in self.folder.iterdir() if path.name != LOCK and path.suffix != UNFINISHED_SUFFIX
        )
        if others:
            raise ConfigError(
                f'{self.folder}: holds {others[0]!r} and no {MANIFEST}; allowed: an '
                f'empty or new folder, or one with results of this campaign'
            )

    def _lock(self, opened: contextlib.ExitStack) -> None:
        """Lock the folder until this process ends, however it does."""
        file = opened.enter_context(open(self.folder / LOCK, 'ab'))  # noqa: SIM115 (the stack closes it)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ConfigError(f'{self.folder}: another campaign is writing here; allowed: one at a time') from None
        except OSError as error:
            log.warning(
                '%s: this file system has no locks (%s): do not start a second campaign here',
                self.folder,
                error.strerror,
            )

    def _begin_or_resume(self, run: Dict[str, Any]) -> None:
        path = self.folder / MANIFEST
        manifest = manifest_of(self._campaign, run)
        if path.is_file():
            old = _read_manifest(path)
            self._check_same(old, manifest)
            _warn_of_other_code(self.folder, old['runs'][0], run)
            manifest = {**old, 'runs': [*old['runs'], run]}
            self._rows = self._read_rows()
        _remove_unfinished(self.folder)
        # First of all: without it, whatever is in the folder is not this program's.
        write_file(path, json.dumps(manifest, indent=1).encode('utf-8'))
        if self._campaign.params.record != 'none':
            (self.folder / BAGS).mkdir(exist_ok=True)
        self._write_table()

    def _check_same(self, old: Dict[str, Any], new: Dict[str, Any]) -> None:
        if old['fingerprint'] == new['fingerprint']:
            return
        # Through JSON, as the old one went: tuples are lists there.
        found = differences(old['configuration'], json.loads(json.dumps(new['configuration'])))
        more = len(found) - DIFFERENCES_SHOWN
        raise ConfigError(
            f'{self.folder}: has results of another configuration: '
            f'{"; ".join(found[:DIFFERENCES_SHOWN])}{f"; and {more} more" if more > 0 else ""}; '
            f'allowed: the same configuration, to continue, or another folder'
        )

    # ---- trials.csv

    def _read_rows(self) -> Dict[int, TrialRow]:
        """Read the finished trials, without a torn last line and without those whose bag is gone."""
        path = self.folder / TABLE
        content = path.read_bytes() if path.is_file() else b''
        # A line is written at one stroke and ends last: what follows the last end is torn.
        whole = content[: content.rfind(b'\n') + 1]
        rows: Dict[int, TrialRow] = {}
        for job, row in self._parsed(whole, path):
            has_bag = not row.bag or (self.folder / row.bag).is_file()
            if has_bag:
                rows.setdefault(job.index, row)
        return rows

    def _parsed(self, content: bytes, path: Path) -> Iterator[Tuple[TrialJob, TrialRow]]:
        head = csv_line(header(self._varied_keys)).rstrip()
        for number, line in enumerate(content.splitlines(), start=1):
            if number == 1 and line == head:
                continue
            try:
                row = row_of(csv_fields(line), self._varied_keys)
                job = self._jobs[row.identity()]
                if row.bag != self.bag_path(job):
                    raise ValueError
            except (ValueError, KeyError):
                raise ConfigError(
                    f'{path}: line {number} does not belong to this campaign; expected the file as campaign wrote it, '
                    'or without this line, whose trial is then run again'
                ) from None
            yield job, row

    def _write_table(self) -> None:
        lines = [header(self._varied_keys), *map(fields_of, self.rows)]
        write_file(self.folder / TABLE, b''.join(map(csv_line, lines)))


@contextlib.contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f'{error.filename or path}: cannot be read or written: {error.strerror or error}') from None


def _jobs_by_identity(campaign: Campaign) -> Dict[Tuple[object, ...], TrialJob]:
    """Return the jobs by `TrialRow.identity`."""
    cells = [(cell.test.name, ppr_label(cell.ppr), cell.varied_texts()) for cell in campaign.cells]
    return {(*cells[job.cell_index], job.trial, job.seed): job for job in campaign.jobs()}


def _write_all(file: io.FileIO, content: bytes) -> None:
    while content:
        content = content[file.write(content) :]
    os.fsync(file.fileno())


def _warn_of_other_code(folder: Path, first: Dict[str, Any], run: Dict[str, Any]) -> None:
    changes = differences(*({key: about.get(key) for key in ('versions', 'commit')} for about in (first, run)))
    if changes:
        log.warning(
            '%s: the results so far are from another version of the code, and may differ from new ones: %s',
            folder,
            '; '.join(changes),
        )


def _remove_unfinished(folder: Path) -> None:
    """Remove what a killed campaign had not finished writing."""
    for path in (*folder.glob(f'*{UNFINISHED_SUFFIX}'), *(folder / BAGS).glob(f'*{UNFINISHED_SUFFIX}')):
        path.unlink()


def _read_manifest(path: Path) -> Dict[str, Any]:
    try:
        manifest = json.loads(path.read_text(encoding='utf-8'))
        if isinstance(manifest['runs'][0], dict) and isinstance(manifest['configuration'], dict):
            return {'fingerprint': '', **manifest}
    except (ValueError, LookupError, TypeError):
        pass
    raise ConfigError(f'{path}: not the manifest of a campaign; expected it as campaign wrote it')
