"""The results folder of a campaign: manifest.json, trials.csv, bags/; and the row of a finished trial."""

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
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX, write_file
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_version
from diff_encoder_sim.base.processes import cpu_model, git, usable_cores
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import FinalErrors, Outcome
from diff_encoder_sim.trials.campaign_cells import BAGS, Campaign, RequestedTrial

log = logging.getLogger(__name__)

MANIFEST, TABLE, LOCK = 'manifest.json', 'trials.csv', '.lock'


# ---- the row of a finished trial


class TrialRow(NamedTuple):
    """A finished trial. `COLUMNS` has the same in the order of trials.csv."""

    test: str
    ppr: str  # as encoder_params.ppr_label writes it
    varied: Tuple[Tuple[str, str], ...]  # dotted keys of parameters, and their values as text
    trial: int
    seed: int
    outcome: Outcome  # one of OUTCOMES
    reason: str  # of any outcome except SUCCEEDED
    duration_s: float  # simulated
    errors: FinalErrors
    distance_m: float  # length of the true path
    wall_time_s: float = 0.0
    bag: str = ''  # path below the results folder; '' for none

    def identity(self) -> Tuple[object, ...]:
        """Return the first fields, up to the seed, which identify the trial."""
        return self[:5]


# Parts of a final error, in the map's axes.
PARTS = ('x_m', 'y_m', 'yaw_rad')
# Types of columns by name, after `test`, `ppr` and the varied parameters, which are text; units are in the names.
COLUMNS = {
    'trial': int,
    'seed': int,
    'outcome': str,
    'reason': str,
    'duration_s': float,
    **{f'{source.value}_{part}': float for source in PoseSource for part in PARTS},  # empty without a pose
    'distance_m': float,
    'wall_time_s': float,
    'bag': str,
}
# A lockstep trial has no ROS graph that fails, and a trial without a result has no row.
OUTCOMES = tuple(outcome for outcome in Outcome if outcome not in (Outcome.FAILED, Outcome.TORN))


def header(varied_keys: Sequence[str]) -> List[str]:
    """Return the names of the columns."""
    return ['test', 'ppr', *varied_keys, *COLUMNS]


def fields_of(row: TrialRow) -> List[str]:
    """Return the row as texts; numbers read back as the same numbers, wall time to the millisecond."""
    values: Dict[str, Any] = {**row._asdict(), 'outcome': row.outcome.value, 'wall_time_s': round(row.wall_time_s, 3)}
    values['reason'] = ''.join(char if char.isprintable() else ' ' for char in row.reason)  # a row is one line
    for source, error in row.errors.items():
        values.update((f'{source.value}_{part}', value) for part, value in zip(PARTS, error or ()))
    texts = [str(kind(values[name])) if name in values else '' for name, kind in COLUMNS.items()]
    return [row.test, row.ppr, *(text for _, text in row.varied), *texts]


def row_of(fields: Sequence[str], varied_keys: Sequence[str]) -> TrialRow:
    """Return the row of the texts that `fields_of` returned.

    Raises:
        ValueError: these are not the fields of a row.
    """
    names = header(varied_keys)
    if len(fields) != len(names):
        raise ValueError(f'{len(fields)} fields; expected {len(names)}')
    texts = dict(zip(names, fields))
    errors: FinalErrors = {}
    for source in PoseSource:
        error = [texts.pop(f'{source.value}_{part}') for part in PARTS]
        errors[source] = Pose2D(*map(float, error)) if any(error) else None
    values: Dict[str, Any] = {name: COLUMNS.get(name, str)(text) for name, text in texts.items()}
    varied = tuple((key, values.pop(key)) for key in varied_keys)
    outcome = Outcome(values.pop('outcome'))
    if outcome not in OUTCOMES:
        raise ValueError(f'outcome {outcome.value}')
    return TrialRow(**values, varied=varied, errors=errors, outcome=outcome)


def csv_line(fields: Sequence[str]) -> bytes:
    """Return one line of a CSV file, including its end."""
    text = io.StringIO()
    csv.writer(text, lineterminator='\n').writerow(fields)
    return text.getvalue().encode('utf-8')


def csv_fields(line: bytes) -> List[str]:
    """Return the fields of a line from `csv_line`, with or without its end.

    Raises:
        ValueError: this is no such line.
    """
    try:
        return next(csv.reader([line.decode('utf-8')], strict=True))
    except csv.Error as error:
        raise ValueError(str(error)) from None


class TrialsTable:
    """A file with a header, and a line for each finished trial.

    A line is written in one call and its end comes last: a line without end is incomplete, and ignored.
    """

    def __init__(self, path: Path, varied_keys: Sequence[str]) -> None:
        self.path, self._varied_keys = path, varied_keys

    def rows(self) -> Iterator[Tuple[int, TrialRow]]:
        """Read the complete lines, with their numbers from 1; nothing if there is no file.

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
        """Return the error for a line that is not of this campaign."""
        expected = 'expected the file as campaign wrote it, or without this line, whose trial is then run again'
        return ConfigError(f'{self.path}: line {number} does not belong to this campaign; {expected}')

    def write(self, rows: Iterable[TrialRow]) -> None:
        """Replace the file, completely or not at all."""
        lines = [header(self._varied_keys), *map(fields_of, rows)]
        write_file(self.path, b''.join(map(csv_line, lines)))

    def append(self, row: TrialRow) -> None:
        """Add a line; it is on the disk when this returns. After an error the lines before are complete.

        Raises:
            OSError: the disk is full, or the like.
        """
        content = csv_line(fields_of(row))
        with io.FileIO(str(self.path), 'ab') as file:
            size = os.fstat(file.fileno()).st_size
            try:
                while content:
                    content = content[file.write(content) :]
                os.fsync(file.fileno())
            except OSError:
                with contextlib.suppress(OSError):
                    file.truncate(size)
                raise


# ---- the manifest

# Those that a result can depend on, and those that run the trials.
LIBRARIES = ('numpy', 'numba', 'pybullet', 'rosbags', 'pydantic', 'xacro', 'dask', 'distributed')
ABSENT = '(absent)'
DIFFERENCES_SHOWN = 3


def manifest_of(campaign: Campaign, run: Dict[str, Any]) -> Dict[str, Any]:
    """Return the content of a new folder's manifest; `run` is from `describe_run`."""
    seed, trials = campaign.params.seed, campaign.params.trials
    diameter_m = campaign.cells[0].robot_params.odometry.wheel_diameter
    encoders = [
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
    return {
        'name': campaign.params.name,
        'fingerprint': campaign.fingerprint(),
        'seeds': {'first': seed + 1, 'last': seed + trials},
        'runs': [run],
        **({'robot': campaign.robot.as_json()} if campaign.robot else {}),
        **({'encoders': encoders} if campaign.params.encoders else {}),
        **({'config_files': dict(campaign.params.files)} if campaign.params.files else {}),
        'configuration': campaign.resolved(),
    }


def describe_run(package_folder: Path, command: Sequence[str]) -> Dict[str, Any]:
    """Describe the program and host of this process: versions, commit, host, command line and time."""
    versions: Dict[str, Optional[str]] = {
        'diff_encoder_sim': package_version(package_folder),
        'python': platform.python_version(),
    }
    for library in LIBRARIES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[library] = None
            versions[library] = importlib.metadata.version(library)
    # None if the package is installed, even within another checkout.
    is_checkout = git(package_folder, 'ls-files', '--error-unmatch', 'package.xml') is not None
    commit = {
        'id': git(package_folder, 'rev-parse', 'HEAD'),
        'is_dirty': git(package_folder, 'status', '--porcelain') != '',
    }
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
    """List the dotted keys in which two values of JSON differ, each with both values."""
    there, here = dict(_flat(old, '')), dict(_flat(new, ''))
    return [
        f'{key}: {there.get(key, ABSENT)!r} there, {here.get(key, ABSENT)!r} here'
        for key in {**there, **here}
        if there.get(key, ABSENT) != here.get(key, ABSENT)
    ]


def _flat(value: Any, path: str) -> Iterator[Tuple[str, Any]]:
    if not isinstance(value, (dict, list)):
        yield path, value
        return
    for key, below in value.items() if isinstance(value, dict) else enumerate(value):
        yield from _flat(below, f'{path}.{key}' if path else str(key))


# ---- the folder


class ResultStore:
    """One campaign's results, written by one process; a context that ends with the folder unlocked.

    A trial counts as done when its line in trials.csv is complete; otherwise it is pending.
    """

    def __init__(
        self, folder: Union[str, Path], campaign: Campaign, run: Dict[str, Any], must_resume: bool = False
    ) -> None:
        """Begin a folder, or resume one.

        Args:
            folder: made if there is none.
            campaign: whose results it contains; a folder with another campaign's is an error.
            run: from `describe_run`.
            must_resume: whether a folder without results is an error.

        Raises:
            ConfigError: the folder has other things in it or cannot be used.
        """
        self.folder, self._campaign = Path(folder), campaign
        self._trials = {trial.identity(): trial for trial in campaign.trials()}
        self._rows: Dict[int, TrialRow] = {}  # by position of trial
        self._table = TrialsTable(self.folder / TABLE, campaign.params.varied_keys)
        with contextlib.ExitStack() as opened, _named_errors(self.folder):
            self._refuse_foreign(must_resume)
            self.folder.mkdir(parents=True, exist_ok=True)
            opened.enter_context(locked(self.folder))
            self._refuse_foreign(must_resume)  # again, now that no other process writes here
            self._begin_or_resume(run)
            self._opened = opened.pop_all()

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(self, *_: object) -> None:
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
            ConfigError: the disk is full, or the like; the rows before are complete.
        """
        position = self._trials[row.identity()].position
        if position not in self._rows:
            with _named_errors(self._table.path):
                self._table.append(row)
            self._rows[position] = row

    def finish(self) -> Path:
        """Sort trials.csv in the order of trials, and return its path.

        Raises:
            ConfigError: it cannot be written; the unsorted one is still there.
        """
        with _named_errors(self._table.path):
            self._table.write(self.rows)
            if not self.pending():
                self._remove_unfinished()
        return self._table.path

    def _refuse_foreign(self, must_resume: bool) -> None:
        bags, has_manifest = self.folder / BAGS, (self.folder / MANIFEST).is_file()
        if bags.is_symlink():
            allowed = 'a folder, as nothing is written or removed outside of the results folder'
            raise ConfigError(f'{bags}: given a link to {str(bags.resolve())!r}; allowed: {allowed}')
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
            changes = differences(
                *({key: of.get(key) for key in ('versions', 'commit')} for of in (old['runs'][0], run))
            )
            if changes:
                text = '%s: the results so far are from another version of the code, and may differ from new ones: %s'
                log.warning(text, self.folder, '; '.join(changes))
            manifest = {**old, 'runs': [*old['runs'], run]}
            self._read_rows()
        self._remove_unfinished()
        # First of all: a folder without it is taken for another program's.
        write_file(path, json.dumps(manifest, indent=1).encode('utf-8'))
        if self._campaign.params.record != 'none':
            (self.folder / BAGS).mkdir(exist_ok=True)
        self._table.write(self.rows)

    def _check_same(self, old: Dict[str, Any], new: Dict[str, Any]) -> None:
        if old['fingerprint'] == new['fingerprint']:
            return
        # Through JSON, as the old one: tuples are lists there.
        found = differences(old['configuration'], json.loads(json.dumps(new['configuration'])))
        more = len(found) - DIFFERENCES_SHOWN
        listed = '; '.join([*found[:DIFFERENCES_SHOWN], *([f'and {more} more'] if more > 0 else [])])
        allowed = 'the same configuration, to continue, or another folder'
        raise ConfigError(f'{self.folder}: has results of another configuration: {listed}; allowed: {allowed}')

    def _read_rows(self) -> None:
        """Read the finished trials; those whose bag is gone are left out."""
        for number, row in self._table.rows():
            trial = self._trials.get(row.identity())
            if trial is None or row.bag != trial.bag:
                raise self._table.foreign_line(number)
            if not row.bag or (self.folder / row.bag).is_file():
                self._rows.setdefault(trial.position, row)

    def _remove_unfinished(self) -> None:
        """Remove the files that a killed campaign, or a killed worker, had not finished writing."""
        for folder in (self.folder, self.folder / BAGS):
            for path in folder.glob(f'*{UNFINISHED_SUFFIX}'):
                path.unlink(missing_ok=True)


def locked(folder: Path) -> io.FileIO:
    """Lock a folder until the returned file is closed, or this process ends for any reason.

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
        text = '%s: this file system has no locks (%s): do not start a second campaign with this folder'
        log.warning(text, folder, error.strerror)
    return file


@contextlib.contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f'{error.filename or path}: cannot be read or written: {error.strerror or error}') from None
