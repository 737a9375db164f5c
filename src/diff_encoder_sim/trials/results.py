"""The results folder of a campaign: manifest.json, trials.csv, bags/."""

from __future__ import annotations

import contextlib
import csv
import fcntl
import importlib.metadata
import io
import json
import logging
import os
import platform
from datetime import datetime, timezone
from pathlib import Path
from types import TracebackType
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Type, Union

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX, write_file
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_version
from diff_encoder_sim.base.processes import cpu_model, git, usable_cores
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import FinalErrors, Outcome
from diff_encoder_sim.trials.campaign_cells import BAGS, Campaign, RequestedTrial

MANIFEST, TABLE, LOCK = 'manifest.json', 'trials.csv', '.lock'


log = logging.getLogger(__name__)


def locked(folder: Path) -> io.FileIO:
    """Lock a folder until the returned file is closed, or this process ends in whatever way.

    Raises:
        ConfigError: another process has locked it.
        OSError: the lock's file cannot be made.
    """
    file = io.FileIO(str(folder / LOCK), 'ab')
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise ConfigError(f'{folder}: another campaign is writing here; allowed: one at a time') from None
    except OSError as error:
        log.warning(
            '%s: this file system has no locks (%s): do not start a second campaign with this folder',
            folder,
            error.strerror,
        )
    return file


# Those that a result can depend on, and those that run the trials.
LIBRARIES = ('numpy', 'numba', 'pybullet', 'rosbags', 'pydantic', 'xacro', 'dask', 'distributed')
ABSENT = '(absent)'


def manifest_of(campaign: Campaign, run: Dict[str, Any]) -> Dict[str, Any]:
    """Return the content of a new folder's manifest; `run` is from `describe_run`."""
    seed, trials = campaign.params.seed, campaign.params.trials
    return {
        'name': campaign.params.name,
        'fingerprint': campaign.fingerprint(),
        'seeds': {'first': seed + 1, 'last': seed + trials},
        'runs': [run],
        **({'robot': campaign.robot.as_json()} if campaign.robot else {}),
        **({'encoders': _encoders(campaign)} if campaign.params.encoders else {}),
        **({'config_files': dict(campaign.params.files)} if campaign.params.files else {}),
        'configuration': campaign.resolved(),
    }


def _encoders(campaign: Campaign) -> List[Dict[str, Any]]:
    """Return what is known of the real encoders, and what their counts follow from."""
    diameter_m = campaign.cells[0].robot_params.odometry.wheel_diameter
    return [
        {
            'label': encoder.label,
            'name': encoder.real.name,
            'source': list(encoder.real.source),
            'price': encoder.real.price,
            'resolution': encoder.resolution,
            'counts_per_metre': encoder.counts_per_metre(diameter_m),
        }
        for encoder in campaign.encoders
        if encoder.real
    ]


def describe_run(package_folder: Path, command: Sequence[str]) -> Dict[str, Any]:
    """Describe what this process computes with: versions, commit, host, command line and time."""
    return {
        'started': datetime.now(timezone.utc).isoformat(timespec='seconds'),
        'command': list(command),
        'versions': _versions(package_folder),
        'commit': _commit(package_folder),
        'machine': _host(),
    }


def read_manifest(path: Path) -> Dict[str, Any]:
    """Read a manifest back.

    Raises:
        ConfigError: it is not as it was written.
    """
    try:
        manifest = json.loads(path.read_text(encoding='utf-8'))
        if isinstance(manifest['runs'][0], dict) and isinstance(manifest['configuration'], dict):
            return {'fingerprint': '', **manifest}
    except (ValueError, LookupError, TypeError):
        pass
    raise ConfigError(f'{path}: not the manifest of a campaign; expected it as campaign wrote it')


def differences(old: Any, new: Any) -> List[str]:
    """List the keys in which two resolved configurations differ, each with both values, a line each."""
    there, here = dict(_flat(old, '')), dict(_flat(new, ''))
    return [
        f'{key}: {there.get(key, ABSENT)!r} there, {here.get(key, ABSENT)!r} here'
        for key in {**there, **here}
        if there.get(key, ABSENT) != here.get(key, ABSENT)
    ]


def _flat(value: Any, path: str) -> Iterator[Tuple[str, Any]]:
    """Yield single values by dotted paths."""
    if not isinstance(value, (dict, list)):
        yield path, value
        return
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, below in items:
        yield from _flat(below, f'{path}.{key}' if path else str(key))


def _versions(package_folder: Path) -> Dict[str, Optional[str]]:
    versions: Dict[str, Optional[str]] = {
        'diff_encoder_sim': package_version(package_folder),
        'python': platform.python_version(),
    }
    for library in LIBRARIES:
        try:
            versions[library] = importlib.metadata.version(library)
        except importlib.metadata.PackageNotFoundError:
            versions[library] = None
    return versions


def _commit(package_folder: Path) -> Optional[Dict[str, Any]]:
    """Return the checkout's commit; None where the package is installed, even within another checkout."""
    if git(package_folder, 'ls-files', '--error-unmatch', 'package.xml') is None:
        return None
    return {
        'id': git(package_folder, 'rev-parse', 'HEAD'),
        'is_dirty': git(package_folder, 'status', '--porcelain') != '',
    }


def _host() -> Dict[str, Any]:
    return {
        'host': platform.node(),
        'cpu': cpu_model(),
        'cores': os.cpu_count(),
        'usable_cores': usable_cores(),
        'memory_bytes': os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES'),
        'os': platform.platform(),
    }


PARTS = ('x_m', 'y_m', 'yaw_rad')

# A lockstep trial has no ROS graph that fails, and a trial without a result has no row.
OUTCOMES = tuple(outcome for outcome in Outcome if outcome not in (Outcome.FAILED, Outcome.TORN))


class TrialRow(NamedTuple):
    """A trial and how it ended."""

    test: str
    ppr: str  # as encoders.pulses.ppr_label writes it
    varied: Tuple[Tuple[str, str], ...]  # dotted keys of parameters, and their values as text
    trial: int
    seed: int
    outcome: Outcome  # one of OUTCOMES
    reason: str  # of any but succeeded
    duration_s: float  # simulated
    errors: FinalErrors
    distance_m: float  # length of the true path
    wall_time_s: float = 0.0
    bag: str = ''  # path below the results folder; '' for none

    def identity(self) -> Tuple[str, str, Tuple[Tuple[str, str], ...], int, int]:
        """Return what identifies the trial: the first fields, up to the seed."""
        return self[:5]


def header(varied_keys: Sequence[str]) -> List[str]:
    """Return the names of the columns, with their units."""
    return [
        'test',
        'ppr',
        *varied_keys,
        'trial',
        'seed',
        'outcome',
        'reason',
        'duration_s',
        *(f'{source.value}_{part}' for source in PoseSource for part in PARTS),
        'distance_m',
        'wall_time_s',
        'bag',
    ]


def fields_of(row: TrialRow) -> List[str]:
    """Return the row as texts; numbers read back as the same numbers, wall time to the millisecond."""
    errors = [row.errors.get(source) or ('',) * len(PARTS) for source in PoseSource]
    values = [
        row.test,
        row.ppr,
        *(text for _, text in row.varied),
        row.trial,
        row.seed,
        row.outcome.value,
        _one_line(row.reason),
        float(row.duration_s),
        *(part if part == '' else float(part) for error in errors for part in error),
        float(row.distance_m),
        round(float(row.wall_time_s), 3),
        row.bag,
    ]
    return [value if isinstance(value, str) else repr(value) for value in values]


def row_of(fields: Sequence[str], varied_keys: Sequence[str]) -> TrialRow:
    """Return the row that `fields_of` made into texts.

    Raises:
        ValueError: these are not the fields of a row.
    """
    names = header(varied_keys)
    if len(fields) != len(names):
        raise ValueError(f'{len(fields)} fields; expected {len(names)}')
    by_name = dict(zip(names, fields))
    return TrialRow(
        by_name['test'],
        by_name['ppr'],
        tuple((key, by_name[key]) for key in varied_keys),
        int(by_name['trial']),
        int(by_name['seed']),
        _outcome(by_name['outcome']),
        by_name['reason'],
        float(by_name['duration_s']),
        {source: _error(by_name, source) for source in PoseSource},
        float(by_name['distance_m']),
        float(by_name['wall_time_s']),
        by_name['bag'],
    )


def csv_line(fields: Sequence[str]) -> bytes:
    """One line of a CSV file, its end included."""
    text = io.StringIO()
    csv.writer(text, lineterminator='\n').writerow(fields)
    return text.getvalue().encode('utf-8')


def csv_fields(line: bytes) -> List[str]:
    """Return the fields that `csv_line` made into a line, with or without its end.

    Raises:
        ValueError: this is no such line.
    """
    try:
        return next(csv.reader([line.decode('utf-8')], strict=True))
    except csv.Error as error:
        raise ValueError(str(error)) from None


def _one_line(text: str) -> str:
    """Return a text without line ends: a row is one line of the file."""
    return ''.join(char if char.isprintable() else ' ' for char in text)


def _outcome(text: str) -> Outcome:
    for outcome in OUTCOMES:
        if outcome.value == text:
            return outcome
    raise ValueError(f'outcome {text!r}; expected {", ".join(outcome.value for outcome in OUTCOMES)}')


def _error(by_name: Dict[str, str], source: PoseSource) -> Optional[Pose2D]:
    texts = [by_name[f'{source.value}_{part}'] for part in PARTS]
    if texts == [''] * len(PARTS):
        return None
    return Pose2D(*map(float, texts))


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
        self._trials = {trial.identity(): trial for trial in campaign.trials()}
        self._rows: Dict[int, TrialRow] = {}  # by position of trial
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
        """Return the results of the finished trials, in the order of trials."""
        return [self._rows[position] for position in sorted(self._rows)]

    def pending(self) -> List[RequestedTrial]:
        """Return the trials that are still to be run."""
        return [trial for trial in self._trials.values() if trial.position not in self._rows]

    def append(self, row: TrialRow) -> None:
        """Keep a finished trial; it is on the disk when this returns. A second row of the same trial is dropped.

        Raises:
            ConfigError: the disk is full, or the like; the rows before are whole.
        """
        trial = self._trials[row.identity()]
        if trial.position not in self._rows:
            with _named_errors(self._table.path):
                self._table.append(row)
            self._rows[trial.position] = row

    def finish(self) -> Path:
        """Sort trials.csv in the order of trials, and take no more rows; return its path.

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
        """Read the finished trials by position; those whose bag is gone are left out."""
        rows: Dict[int, TrialRow] = {}
        for number, row in self._table.rows():
            trial = self._trials.get(row.identity())
            if trial is None or row.bag != trial.bag:
                raise self._table.foreign_line(number)
            if not row.bag or (self.folder / row.bag).is_file():
                rows.setdefault(trial.position, row)
        return rows


@contextlib.contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f'{error.filename or path}: cannot be read or written: {error.strerror or error}') from None


def _warn_of_other_code(folder: Path, first: Dict[str, Any], run: Dict[str, Any]) -> None:
    changes = differences(*({key: about.get(key) for key in ('versions', 'commit')} for about in (first, run)))
    if changes:
        text = '%s: the results so far are from another version of the code, and may differ from new ones: %s'
        log.warning(text, folder, '; '.join(changes))


def _remove_unfinished(folder: Path) -> None:
    """Remove the files that a killed campaign, or a killed worker, had not finished writing."""
    for path in (*folder.glob(f'*{UNFINISHED_SUFFIX}'), *(folder / BAGS).glob(f'*{UNFINISHED_SUFFIX}')):
        path.unlink(missing_ok=True)
