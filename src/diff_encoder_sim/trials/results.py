"""The results folder of a campaign: manifest.json, trials.csv, bags/."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import importlib.metadata
import io
import json
import logging
import os
import platform
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Sequence, Tuple, Union

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX, write_file
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_version
from diff_encoder_sim.base.processes import cpu_model, git, usable_cores
from diff_encoder_sim.trials.campaign_cells import Campaign, RequestedTrial
from diff_encoder_sim.trials.trials_csv import BAGS, MANIFEST, TABLE, TrialRow, line_of, read_rows, table_of

log = logging.getLogger(__name__)

LOCK = '.lock'
# Libraries that can affect results or run the trials.
LIBRARIES = ('numpy', 'numba', 'pybullet', 'rosbags', 'pydantic', 'xacro', 'dask', 'distributed')
ABSENT = '(absent)'
DIFFERENCES_SHOWN = 3


def describe_run(package_folder: Path, command: Sequence[str]) -> Dict[str, Any]:
    """Describe the program and host of this process: versions, commit, host, command line and time."""
    versions = {'diff_encoder_sim': package_version(package_folder), 'python': platform.python_version()}
    for library in LIBRARIES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[library] = importlib.metadata.version(library)
    # None if the package is installed, even within another checkout.
    is_checkout = git(package_folder, 'ls-files', '--error-unmatch', 'package.xml') is not None
    is_dirty = git(package_folder, 'status', '--porcelain') != ''
    commit = {'id': git(package_folder, 'rev-parse', 'HEAD'), 'is_dirty': is_dirty}
    return {
        'started': datetime.now(timezone.utc).isoformat(timespec='seconds'),
        'command': list(command),
        'versions': versions,
        'commit': commit if is_checkout else None,
        'machine': {
            'host': platform.node(),
            'cpu': cpu_model(),
            'cores': os.cpu_count(),
            'usable_cores': usable_cores(),
            'memory_bytes': os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES'),
            'os': platform.platform(),
        },
    }


def differences(old: Any, new: Any) -> List[str]:
    """List the dotted keys in which two values of JSON differ, each with both values."""
    there, here = dict(_flat(old, '')), dict(_flat(new, ''))
    pairs = {key: (there.get(key, ABSENT), here.get(key, ABSENT)) for key in {**there, **here}}
    return [f'{key}: {was!r} there, {now!r} here' for key, (was, now) in pairs.items() if was != now]


def _flat(value: Any, path: str) -> Iterator[Tuple[str, Any]]:
    if not isinstance(value, (dict, list)):
        yield path, value
        return
    for key, below in value.items() if isinstance(value, dict) else enumerate(value):
        yield from _flat(below, f'{path}.{key}' if path else str(key))


class ResultsFolder(NamedTuple):
    """A results folder as workers of other hosts see it; one that reads the same manifest there shares it."""

    path: str  # absolute, on the client's host
    manifest_sha256: str

    def is_shared(self) -> bool:
        """Return whether this process can access and write to the client's folder."""
        with contextlib.suppress(OSError):
            return _sha256(Path(self.path, MANIFEST)) == self.manifest_sha256 and os.access(self.path, os.W_OK)
        return False


class ResultStore:
    """One campaign's results, written by one process; a context that ends with the folder unlocked.

    A trial counts as done when its line in trials.csv is complete; otherwise it is pending.
    """

    def __init__(
        self, folder: Union[str, Path], campaign: Campaign, run: Dict[str, Any], must_resume: bool = False
    ) -> None:
        """Create or resume a folder, `run` of `describe_run`; ConfigError for others' files, or none to resume."""
        self.folder, self._campaign = Path(folder), campaign
        self._trials = {trial.identity(): trial for trial in campaign.trials()}
        self._rows: Dict[Tuple[object, ...], TrialRow] = {}  # by identity of trial
        self._table, self._varied_keys = self.folder / TABLE, list(campaign.params.varied_values)
        with contextlib.ExitStack() as opened, _named_errors(self.folder):
            self._refuse_foreign(must_resume)
            self.folder.mkdir(parents=True, exist_ok=True)
            opened.enter_context(_locked(self.folder))
            self._begin_or_resume(run)
            self._opened = opened.pop_all()

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    @property
    def rows(self) -> List[TrialRow]:
        """Return the results of the finished trials, in the order of trials."""
        return [self._rows[identity] for identity in self._trials if identity in self._rows]

    def pending(self) -> List[RequestedTrial]:
        """Return the pending trials."""
        return [trial for identity, trial in self._trials.items() if identity not in self._rows]

    def shared_folder(self) -> ResultsFolder:
        """Return the folder for workers, which may run on other hosts."""
        return ResultsFolder(str(self.folder.resolve()), _sha256(self.folder / MANIFEST))

    def append(self, row: TrialRow) -> None:
        """Store a finished trial on disk unless it is stored; ConfigError if that fails; earlier rows are complete."""
        if row.identity() not in self._rows:
            with _named_errors(self._table), open(self._table, 'ab') as file:
                file.write(line_of(row))
                file.flush()
                os.fsync(file.fileno())
            self._rows[row.identity()] = row

    def finish(self) -> Path:
        """Sort trials.csv in the order of trials, and return its path; ConfigError keeps the unsorted file."""
        with _named_errors(self._table):
            write_file(self._table, table_of(self.rows, self._varied_keys))
            if not self.pending():
                self._remove_unfinished()
        return self._table

    def _refuse_foreign(self, must_resume: bool) -> None:
        found = [path.name for path in self.folder.iterdir()] if self.folder.exists() else []
        others = [name for name in found if name != LOCK and not name.endswith(UNFINISHED_SUFFIX)]
        if must_resume and MANIFEST not in others:
            allowed = 'a folder with results, or no --resume'
            raise ConfigError(f'{self.folder}: nothing to resume: no {MANIFEST}; allowed: {allowed}')
        if others and MANIFEST not in others:
            allowed = 'an empty or new folder, or one with results of this campaign'
            raise ConfigError(f'{self.folder}: holds {min(others)!r} and no {MANIFEST}; allowed: {allowed}')

    def _begin_or_resume(self, run: Dict[str, Any]) -> None:
        path = self.folder / MANIFEST
        manifest = {**self._campaign.manifest(), 'runs': [run]}
        if path.is_file():
            old = _read_manifest(path)
            if old.get('fingerprint') != manifest['fingerprint']:
                # Via JSON, as the old one, which converts tuples to lists.
                found = differences(old['configuration'], json.loads(json.dumps(manifest['configuration'])))
                more = len(found) - DIFFERENCES_SHOWN
                listed = '; '.join([*found[:DIFFERENCES_SHOWN], *([f'and {more} more'] if more > 0 else [])])
                allowed = 'the same configuration, to continue, or another folder'
                raise ConfigError(f'{self.folder}: has results of another configuration: {listed}; allowed: {allowed}')
            first, this = ({key: of.get(key) for key in ('versions', 'commit')} for of in (old['runs'][0], run))
            changes = differences(first, this)
            if changes:
                text = '%s: the results so far are from another version of the code, and may differ from new ones: %s'
                log.warning(text, self.folder, '; '.join(changes))
            manifest = {**old, 'runs': [*old['runs'], run]}
            bags = {identity: trial.bag for identity, trial in self._trials.items()}
            for row in read_rows(self._table, self._varied_keys, lambda row: bags.get(row.identity()) == row.bag):
                if not row.bag or (self.folder / row.bag).is_file():  # else the trial is run again
                    self._rows.setdefault(row.identity(), row)
        self._remove_unfinished()
        # Written first: a folder without it is rejected as another program's.
        write_file(path, json.dumps(manifest, indent=1).encode('utf-8'))
        if self._campaign.params.record != 'none':
            (self.folder / BAGS).mkdir(exist_ok=True)
        write_file(self._table, table_of(self.rows, self._varied_keys))

    def _remove_unfinished(self) -> None:
        """Remove unfinished files of a killed campaign or worker."""
        for folder in (self.folder, self.folder / BAGS):
            for path in folder.glob(f'*{UNFINISHED_SUFFIX}'):
                path.unlink(missing_ok=True)


def _read_manifest(path: Path) -> Dict[str, Any]:
    with contextlib.suppress(ValueError, LookupError, TypeError):
        manifest: Dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        if isinstance(manifest['runs'][0], dict) and isinstance(manifest['configuration'], dict):
            return manifest
    raise ConfigError(f'{path}: not the manifest of a campaign; expected it as campaign wrote it')


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _locked(folder: Path) -> io.FileIO:
    """Lock a folder until the returned file is closed, or this process ends for any reason."""
    file = io.FileIO(str(folder / LOCK), 'ab')
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise ConfigError(f'{folder}: another campaign is writing here; allowed: one at a time') from None
    except OSError as error:
        text = '%s: this file system has no locks (%s): do not start a second campaign with this folder'
        log.warning(text, folder, error.strerror)
    return file


@contextlib.contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f'{error.filename or path}: cannot be read or written: {error.strerror or error}') from None
