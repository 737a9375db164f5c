"""What is fuzzed, in turns, case by case; the inputs of what falls are kept."""

import contextlib
import io
import shutil
import tempfile
import time
import zlib
from collections import Counter
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Optional

import numpy as np

import fuzz_bags
import fuzz_campaigns
import fuzz_encoders
import fuzz_lockstep
import fuzz_maps
import fuzz_robots
import fuzz_worlds
from sandbox import FALLEN, Limits, Verdict, judge, run_in_sandbox


class Area(NamedTuple):
    """A part of the package, with a function that makes an odd input from a generator in a folder, and uses it."""

    name: str
    run: Callable[[np.random.Generator, Path], None]
    warm_up: Callable[[Path], None]  # loads what every case needs, in the process that cases are forked from
    limits: Limits = Limits()


AREAS = (
    Area('encoders', fuzz_encoders.run, fuzz_encoders.warm_up),
    Area('lockstep', fuzz_lockstep.run, fuzz_lockstep.warm_up, Limits(cpu_s=60)),
    Area('worlds', fuzz_worlds.run, fuzz_worlds.warm_up),
    Area('robots', fuzz_robots.run, fuzz_robots.warm_up),
    Area('maps', fuzz_maps.run, fuzz_maps.warm_up),
    Area('bags', fuzz_bags.run, fuzz_bags.warm_up, Limits(cpu_s=60)),
    Area('campaigns', fuzz_campaigns.run, fuzz_campaigns.warm_up),
)


class Fallen(NamedTuple):
    """A case that fell."""

    area: str
    index: int
    reason: str
    kept: Optional[Path]


class Progress:
    """What was tried of an area, and how long that took."""

    def __init__(self) -> None:
        self.counts: Counter = Counter()  # by kind of verdict
        self.spent_s = 0.0
        self.fallen: List[Fallen] = []

    @property
    def tried(self) -> int:
        """Return the number of cases."""
        return sum(self.counts.values())


def fuzz(areas, seed, cases=None, minutes=None, keep=None) -> Dict[str, Progress]:
    """Try `cases` of each area, or share the minutes among them; inputs of what falls go below the folder `keep`."""
    done = {area.name: Progress() for area in areas}
    for area in areas:
        _warm_up(area)
    end_s = time.monotonic() + 60.0 * (minutes or 0.0)
    while True:
        left = [area for area in areas if cases is None or done[area.name].tried < cases]
        if not left or (cases is None and time.monotonic() > end_s):
            return done
        area = min(left, key=lambda area: done[area.name].spent_s)
        _try(area, seed, keep, done[area.name])


def _warm_up(area: Area) -> None:
    with tempfile.TemporaryDirectory(prefix='fuzz_') as folder, contextlib.redirect_stdout(io.StringIO()):
        area.warm_up(Path(folder))


def _try(area: Area, seed: int, keep: Optional[Path], progress: Progress) -> None:
    index, began_s = progress.tried, time.monotonic()
    folder = Path(tempfile.mkdtemp(prefix='fuzz_'))
    try:
        verdict = run_in_sandbox(lambda: area.run(generator(area, seed, index), folder), folder, area.limits)
        progress.counts[verdict.kind] += 1
        progress.spent_s += time.monotonic() - began_s
        if verdict.kind == FALLEN:
            kept = keep and keep / f'{area.name}_{seed}_{index}'
            if kept:
                shutil.rmtree(kept, ignore_errors=True)
                shutil.copytree(folder, kept, symlinks=True)
            progress.fallen.append(Fallen(area.name, index, verdict.reason, kept))
            print(f'{area.name} {index} fell: {verdict.reason.splitlines()[0][:200]}', flush=True)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def try_again(area: Area, seed: int, index: int) -> Verdict:
    """Run one case in this process, where a debugger can see it; its inputs stay in the folder that is printed."""
    _warm_up(area)
    folder = Path(tempfile.mkdtemp(prefix='fuzz_'))
    print(f'inputs: {folder}')
    return judge(lambda: area.run(generator(area, seed, index), folder))


def generator(area: Area, seed: int, index: int) -> np.random.Generator:
    """Return the generator of a case: the same for the same seed, whatever else is tried."""
    return np.random.default_rng([seed, zlib.crc32(area.name.encode()), index])
