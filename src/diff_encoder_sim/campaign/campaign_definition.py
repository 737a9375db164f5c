"""A campaign: its parameters, cells and trials."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from typing import Any, Dict, Iterator, List, Literal, NamedTuple, Optional, Tuple

from pydantic import AfterValidator, Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import Between
from diff_encoder_sim.base.file_names import PathText
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.campaign.campaign_robot import CampaignRobot
from diff_encoder_sim.campaign.trial_files import TrialFiles
from diff_encoder_sim.encoders.pulses import PerWheel, PulsesPerRevolution
from diff_encoder_sim.lockstep.robot_params import RobotParams
from diff_encoder_sim.recording.bag_files import SUFFIXES
from diff_encoder_sim.recording.topics import RecordMode
from diff_encoder_sim.trials.test_definition import TestDefinition
from diff_encoder_sim.trials.trial_definition import BagFormat, Trial
from diff_encoder_sim.trials.trial_wheels import wheels_of

# A mistyped list, or one list too many, is refused at once and not after the memory is full.
MOST_CELLS, MOST_TRIALS = 10_000, 1_000_000

Varied = Tuple[Tuple[str, Any], ...]  # dotted keys in alphabetical order, and values


def _is_printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError('printable characters')
    return text


ConfigFile = Literal['amcl', 'config', 'lockstep', 'navigation', 'simulator']  # stems of files of config/
Line = Annotated[str, AfterValidator(_is_printable)]
PathLine = Annotated[PathText, AfterValidator(_is_printable)]


class CampaignParams(Params):
    """The keys of a campaign file."""

    name: Line = Field(min_length=1, description='name of the campaign')
    tests: List[PathLine] = Field(min_length=1, description='names of files in config/tests/, or paths of .yaml files')
    ppr: List[PulsesPerRevolution] = Field(min_length=1, description='encoders, in pulses per wheel revolution')
    trials: Annotated[int, Between(1, MOST_TRIALS)] = Field(30, description='trials of each test with each encoder')
    seed: Annotated[int, Between(0, 2**62 - 1)] = Field(0, description='trial k has the seed `seed` + k')
    nav: Literal['embedded', 'scripted'] = Field('embedded', description='navigated, or a drive without feedback')
    record: RecordMode = Field(
        'minimal', description='topics in the bags: all, without bulky ones such as /scan, or no bags'
    )
    bag_format: BagFormat = Field('ros1', description='of the bags: ROS 1, or MCAP files of ROS 2')
    robot: PathLine = Field(
        '', description='name of a robot in config/robots/, a robot file, xacro or URDF; empty: alto'
    )
    files: Dict[ConfigFile, PathLine] = Field(
        {},
        description='in place of amcl.yaml and the other files of config/: `amcl: amcl_accurate`, '
        'another file there, or the path of a .yaml file',
    )
    overrides: Dict[Line, Any] = Field(
        {}, alias='set', description='values of parameters in all trials, by dotted keys'
    )
    vary: Dict[Line, Annotated[List[Any], Field(min_length=1)]] = Field(
        {}, description='values of parameters: each combination is a cell of its own'
    )

    def combinations(self) -> Iterator[Varied]:
        """Yield the combinations of varied parameters; one empty combination where nothing is varied."""
        keys = sorted(self.vary)
        for values in itertools.product(*(self.vary[key] for key in keys)):
            yield tuple(zip(keys, values))

    def cell_count(self) -> int:
        """Count the cells without creating them."""
        return len(self.tests) * len(self.ppr) * math.prod(len(values) for values in self.vary.values())


class CampaignCell(NamedTuple):
    """One test with one encoder and one set of parameters; its trials differ by seed alone."""

    label: str  # in names of files; unique: SL_90_noise0.03
    test: TestDefinition
    ppr: PerWheel
    varied: Varied
    robot_params: RobotParams  # resolved

    def varied_texts(self) -> Tuple[Tuple[str, str], ...]:
        """Return the varied parameters as a table shows them."""
        return tuple((key, text_of(value)) for key, value in self.varied)


class TrialJob(NamedTuple):
    """One trial of a campaign."""

    position: int  # in the order of the results, from 0
    cell_index: int
    trial: int  # from 1 in each cell
    seed: int


class Campaign(NamedTuple):
    """All that is needed to run the trials, on any host."""

    params: CampaignParams
    cells: List[CampaignCell]  # by test, then varied parameters, then PPR
    files: TrialFiles
    robot: Optional[CampaignRobot] = None

    def jobs(self) -> List[TrialJob]:
        """List every trial; equal trial numbers have equal seeds in all cells, and are compared in pairs."""
        numbers = itertools.product(range(len(self.cells)), range(1, self.params.trials + 1))
        return [
            TrialJob(position, cell_index, trial, self.params.seed + trial)
            for position, (cell_index, trial) in enumerate(numbers)
        ]

    def trial_of(self, job: TrialJob) -> Trial:
        """Return the job's trial as it is written into its bag."""
        cell = self.cells[job.cell_index]
        return Trial(
            test=cell.test,
            ppr=cell.ppr,
            number=job.seed,
            nav=self.params.nav,
            **wheels_of(cell.robot_params.odometry, cell.robot_params.encoder),
        )

    def bag_name(self, job: TrialJob) -> str:
        """Name the file of the job's bag: SL_90_007.bag."""
        digits = max(3, len(str(self.params.trials)))
        return f'{self.cells[job.cell_index].label}_{job.trial:0{digits}d}{SUFFIXES[self.params.bag_format]}'

    def resolved(self) -> Dict[str, Any]:
        """Collect everything that determines the results, for JSON: all parameters, files by sha256."""
        params = self.params
        of_one_test = self.cells[: len(self.cells) // len(params.tests)]
        return {
            'tests': [self._dumped_test(cell.test) for cell in self.cells[:: len(of_one_test)]],
            'parameters': [_dumped_parameters(cell) for cell in of_one_test[:: len(params.ppr)]],
            'ppr': [ppr.model_dump(mode='json') for ppr in params.ppr],
            'trials': params.trials,
            'seed': params.seed,
            'nav': params.nav,
            'record': params.record,
            # Left out of bags of ROS 1, so that campaigns from before there was a choice can be completed.
            **({} if params.bag_format == 'ros1' else {'bag_format': params.bag_format}),
            'robot': self.files.robot,
            'files': self.files.sha256(),
        }

    def fingerprint(self) -> str:
        """Compute the sha256 of `resolved`: campaigns of equal fingerprints have equal results."""
        text = json.dumps(self.resolved(), sort_keys=True, allow_nan=False)
        return hashlib.sha256(text.encode('utf-8')).hexdigest()

    def _dumped_test(self, test: TestDefinition) -> Dict[str, Any]:
        return {**test.model_dump(mode='json'), 'files': self.files.worlds[test.name]._asdict()}


def text_of(value: Any) -> str:
    """Return a parameter's value in one printable line."""
    is_plain = isinstance(value, str) and value.isprintable()
    return value if is_plain else json.dumps(value)


def _dumped_parameters(cell: CampaignCell) -> Dict[str, Any]:
    parts = {name: part.model_dump(mode='json') for name, part in cell.robot_params._asdict().items()}
    return {'varied': dict(cell.varied), **parts}
