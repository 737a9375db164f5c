"""The results folder of a campaign: manifest.json, trials.csv, bags/. No kill damages it."""

from __future__ import annotations

import contextlib
import json
import logging
from pathlib import Path
from types import TracebackType
from typing import Any, Dict, Iterator, List, Optional, Tuple, Type, Union

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX, write_file
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.campaign_definition import Campaign, TrialJob
from diff_encoder_sim.trials.manifest import differences, manifest_of, read_manifest
from diff_encoder_sim.trials.results_layout import BAGS, LOCK, MANIFEST, TABLE
from diff_encoder_sim.trials.results_lock import locked
from diff_encoder_sim.trials.trial_row import TrialRow
from diff_encoder_sim.trials.trials_table import TrialsTable

log = logging.getLogger(__name__)

DIFFERENCES_SHOWN = 3


class ResultStore:
    """One campaign's results, written by one process; a context that ends with the folder unlocked.

    A trial counts as done when its line in trials.csv is whole; otherwise it is pending.
    """

    def __init__(
        self, folder: Union[str, Path], campaign: Campaign, run: Dict[str, Any], must_resume: bool = False
    ) -> None:
        """Begin a folder, or resume one.

        Args:
            folder: made when there is none.
            campaign: whose results it holds; a folder with another campaign's is an error.
            run: from `manifest.describe_run`.
            must_resume: whether a folder without results is an error.

        Raises:
            ConfigError: the folder has other things in it or cannot be used.
        """
        self.folder = Path(folder)
        self._campaign = campaign
        self._jobs = _jobs_by_identity(campaign)
        self._rows: Dict[int, TrialRow] = {}  # by position of job
        self._table = TrialsTable(self.folder / TABLE, campaign.params.varied_keys)
        with contextlib.ExitStack() as opened, _named_errors(self.folder):
            self._refuse_foreign(must_resume)
            self.folder.mkdir(parents=True, exist_ok=True)
            opened.enter_context(locked(self.folder))
            self._refuse_foreign(must_resume)  # again, now that nobody else writes here
            self._begin_or_resume(run)
            self._file = opened.enter_context(self._table.open())
            self._opened = opened.pop_all()

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], traceback: Optional[TracebackType]
    ) -> None:
        self._opened.close()

    @property
    def rows(self) -> List[TrialRow]:
        """Return the results of the finished trials, in the order of jobs."""
        return [self._rows[position] for position in sorted(self._rows)]

    def pending(self) -> List[TrialJob]:
        """Return the trials that are still to be run."""
        return [job for job in self._jobs.values() if job.position not in self._rows]

    def bag_path(self, job: TrialJob) -> str:
        """Return the path of the job's bag below the folder; '' when bags are not recorded."""
        is_recorded = self._campaign.params.record != 'none'
        return f'{BAGS}/{self._campaign.bag_name(job)}' if is_recorded else ''

    def append(self, row: TrialRow) -> None:
        """Keep a finished trial; it is on the disk when this returns. A second row of the same trial is dropped.

        Raises:
            ConfigError: the disk is full, or the like; the rows before are whole.
        """
        job = self._jobs[row.identity()]
        if job.position not in self._rows:
            with _named_errors(self._table.path):
                self._table.append(row)
            self._rows[job.position] = row

    def finish(self) -> Path:
        """Sort trials.csv in the order of jobs, and take no more rows; return its path.

        Raises:
            ConfigError: it cannot be written; the unsorted one is still there.
        """
        self._file.close()
        with _named_errors(self._table.path):
            self._table.write(self.rows)
            if not self.pending():
                _remove_unfinished(self.folder)
        return self._table.path

    def _refuse_foreign(self, must_resume: bool) -> None:
        bags = self.folder / BAGS
        if bags.is_symlink():
            allowed = 'a folder, as nothing is written or removed outside of the results folder'
            raise ConfigError(f'{bags}: given a link to {str(bags.resolve())!r}; allowed: {allowed}')
        has_manifest = (self.folder / MANIFEST).is_file()
        if must_resume and not has_manifest:
            allowed = 'a folder with results, or no --resume'
            raise ConfigError(f'{self.folder}: nothing to resume: no {MANIFEST}; allowed: {allowed}')
        if has_manifest or not self.folder.exists():
            return
        others = [path.name for path in self.folder.iterdir() if path.name != LOCK and path.suffix != UNFINISHED_SUFFIX]
        if others:
            allowed = 'an empty or new folder, or one with results of this campaign'
            raise ConfigError(f'{self.folder}: holds {min(others)!r} and no {MANIFEST}; allowed: {allowed}')

    def _begin_or_resume(self, run: Dict[str, Any]) -> None:
        path = self.folder / MANIFEST
        manifest = manifest_of(self._campaign, run)
        if path.is_file():
            old = read_manifest(path)
            self._check_same(old, manifest)
            _warn_of_other_code(self.folder, old['runs'][0], run)
            manifest = {**old, 'runs': [*old['runs'], run]}
            self._rows = self._read_rows()
        _remove_unfinished(self.folder)
        # First of all: a folder without it is taken for somebody else's.
        write_file(path, json.dumps(manifest, indent=1).encode('utf-8'))
        if self._campaign.params.record != 'none':
            (self.folder / BAGS).mkdir(exist_ok=True)
        self._table.write(self.rows)

    def _check_same(self, old: Dict[str, Any], new: Dict[str, Any]) -> None:
        if old['fingerprint'] == new['fingerprint']:
            return
        # Through JSON, as the old one went: tuples are lists there.
        found = differences(old['configuration'], json.loads(json.dumps(new['configuration'])))
        more = len(found) - DIFFERENCES_SHOWN
        listed = '; '.join([*found[:DIFFERENCES_SHOWN], *([f'and {more} more'] if more > 0 else [])])
        allowed = 'the same configuration, to continue, or another folder'
        raise ConfigError(f'{self.folder}: has results of another configuration: {listed}; allowed: {allowed}')

    def _read_rows(self) -> Dict[int, TrialRow]:
        """Read the finished trials by position of job; those whose bag is gone are left out."""
        rows: Dict[int, TrialRow] = {}
        for number, row in self._table.rows():
            job = self._jobs.get(row.identity())
            if job is None or row.bag != self.bag_path(job):
                raise self._table.foreign_line(number)
            if not row.bag or (self.folder / row.bag).is_file():
                rows.setdefault(job.position, row)
        return rows


@contextlib.contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f'{error.filename or path}: cannot be read or written: {error.strerror or error}') from None


def _jobs_by_identity(campaign: Campaign) -> Dict[Tuple[object, ...], TrialJob]:
    """Map jobs by what TrialRow.identity returns."""
    cells = [(cell.test.name, cell.encoder.label, cell.varied_texts()) for cell in campaign.cells]
    return {(*cells[job.cell_index], job.trial, job.seed): job for job in campaign.jobs()}


def _warn_of_other_code(folder: Path, first: Dict[str, Any], run: Dict[str, Any]) -> None:
    changes = differences(*({key: about.get(key) for key in ('versions', 'commit')} for about in (first, run)))
    if changes:
        text = '%s: the results so far are from another version of the code, and may differ from new ones: %s'
        log.warning(text, folder, '; '.join(changes))


def _remove_unfinished(folder: Path) -> None:
    """Remove the files that a killed campaign, or a killed worker, had not finished writing."""
    for path in (*folder.glob(f'*{UNFINISHED_SUFFIX}'), *(folder / BAGS).glob(f'*{UNFINISHED_SUFFIX}')):
        path.unlink(missing_ok=True)
