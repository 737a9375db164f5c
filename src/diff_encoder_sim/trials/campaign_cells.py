"""A campaign: its keys, cells and trials, and the checks before the first one."""

from __future__ import annotations

import hashlib
import itertools
import json
from pathlib import Path
from typing import Any, Dict, List, Literal, NamedTuple, Optional, Sequence, Tuple

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import TRIALS, Between
from diff_encoder_sim.base.params import Line, Params, flat
from diff_encoder_sim.drives.bag_files import SUFFIXES
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world
from diff_encoder_sim.drives.topics import BagFormat, RecordMode
from diff_encoder_sim.drives.trial_definition import Trial, TrialPlan, wheels_of
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_file import RobotSetup
from diff_encoder_sim.robots.simulated_robot import load_simulated_robot
from diff_encoder_sim.simulation.self_check import Check, self_check
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.simulation.slip import WheelSlipParams
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.route_driver import misfit
from diff_encoder_sim.trials.trial_files import TrialFiles
from diff_encoder_sim.trials.trials_csv import BAGS, VARIANT
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.encoder_params import PulsesPerRevolution

Varied = Tuple[Tuple[str, Any], ...]  # dotted keys, or VARIANT, in alphabetical order, and values

ConfigFile = Literal['amcl', 'config', 'fusion', 'lockstep', 'navigation', 'simulator']  # stems of files of config/


class LockstepOptions(Params):
    """Keys of a campaign file that apply to each trial."""

    fusion: Literal['none', 'embedded'] = Field('none', description='of odometry with the IMU, for navigation')
    nav: Literal['embedded', 'scripted'] = Field('embedded', description='navigated, or a drive without feedback')
    record: RecordMode = Field('minimal', description='bags of all topics, without bulky ones such as /scan, or none')
    bag_format: BagFormat = Field('ros1', description='of the bags: ROS 1, or MCAP files of ROS 2')


class CampaignParams(LockstepOptions):
    """The keys of a campaign file."""

    name: Line = Field(min_length=1, description='name of the campaign')
    tests: List[Line] = Field(min_length=1, description='names of files in config/tests/, or paths of .yaml files')
    ppr: List[PulsesPerRevolution] = Field([], description='ideal encoders, in pulses per wheel revolution')
    encoders: List[Line] = Field(
        [], description='real encoders: names of files in config/encoders/, .yaml files, or `catalogue` for all names'
    )
    trials: Annotated[int, TRIALS] = Field(30, description='trials of each test with each encoder')
    seed: Annotated[int, Between(0, 2**62 - 1)] = Field(0, description='trial k has the seed `seed` + k')
    imu: Line = Field('', description='IMU to simulate: name of a file in config/imu/, or a .yaml file; `none`: no IMU')
    robot: Line = Field('', description='name of a robot in config/robots/, a robot file, xacro or URDF; empty: alto')
    files: Dict[ConfigFile, Line] = Field(
        {}, description='replacements of files of config/: `amcl: amcl_accurate`, a file there, or another .yaml file'
    )
    overrides: Dict[Line, Any] = Field({}, alias='set', description='values of parameters by dotted keys')
    vary: Dict[Line, Annotated[List[Any], Field(min_length=1)]] = Field(
        {}, description='values of parameters: each combination is a separate cell'
    )
    variants: Dict[Annotated[Line, Field(min_length=1)], Dict[Line, Any]] = Field(
        {}, description='sets of values by names, each a separate cell; they override `set`; the first is the reference'
    )

    @property
    def varied_values(self) -> Dict[str, List[Any]]:
        """Return the values of varied parameters, each a column of trials.csv, and the names under VARIANT."""
        return dict(sorted({**self.vary, **({VARIANT: list(self.variants)} if self.variants else {})}.items()))

    def value_of(self, key: str, varied: Varied) -> Any:
        """Return the value of a key of this file in a cell, which `vary` or a variant may set."""
        values = dict(varied)
        return {**values, **self.variants.get(values.get(VARIANT, ''), {})}.get(key, getattr(self, key))


class CampaignCell(NamedTuple):
    """One test with one encoder and one set of parameters; its trials differ only in their seed."""

    label: str  # in names of files; unique: SL_90_noise0.03
    test: TestDefinition
    encoder: ChosenEncoder
    varied: Varied
    robot_params: RobotParams  # resolved


class RequestedTrial(NamedTuple):
    """One trial of a campaign: the input of a worker, except for files."""

    position: int  # in the order of the results, from 0
    cell: CampaignCell
    trial: int  # from 1 in each cell
    seed: int
    campaign: CampaignParams

    @property
    def name(self) -> str:
        """Return the stem of its file names, such as SL_90_007."""
        return f'{self.cell.label}_{self.trial:0{max(3, len(str(self.campaign.trials)))}d}'

    @property
    def bag(self) -> str:
        """Return the path of the bag below the results folder, such as bags/SL_90_007.bag; '' if none is recorded."""
        return '' if self.campaign.record == 'none' else f'{BAGS}/{self.name}{SUFFIXES[self.campaign.bag_format]}'

    def identity(self) -> Tuple[object, ...]:
        """Return the first fields of the trial's row."""
        varied = tuple((key, text_of(value)) for key, value in self.cell.varied)
        return self.cell.test.name, self.cell.encoder.label, varied, self.trial, self.seed

    def definition(self) -> Trial:
        """Return the trial as it is written into its bag."""
        cell = self.cell
        return Trial(
            test=cell.test,
            ppr=cell.encoder.ppr,
            number=self.seed,
            nav=self.campaign.nav,
            fusion=self.campaign.value_of('fusion', cell.varied),
            encoder=cell.encoder.name,
            resolution=cell.encoder.resolution,
            variant=dict(cell.varied).get(VARIANT, ''),
            **wheels_of(cell.robot_params.odometry, cell.robot_params.encoder),
        )


class TrialSetup(NamedTuple):
    """A trial, the parameters of its robot, and its options."""

    plan: TrialPlan
    params: RobotParams
    options: LockstepOptions = LockstepOptions()


class Campaign(NamedTuple):
    """All input of the trials, for any host."""

    params: CampaignParams
    tests: List[TestDefinition]
    encoders: List[ChosenEncoder]  # the ideal ones first
    cells: List[CampaignCell]  # by test, then varied parameters, then encoder
    files: TrialFiles
    robot: RobotSetup
    checks: Sequence[Check] = ()  # results of the robot's self-check; empty before it

    def trials(self) -> List[RequestedTrial]:
        """List all trials; equal trial numbers have equal seeds in all cells, for paired comparison."""
        seed, places = self.params.seed, enumerate(itertools.product(self.cells, range(1, self.params.trials + 1)))
        return [RequestedTrial(position, cell, trial, seed + trial, self.params) for position, (cell, trial) in places]

    def resolved(self) -> Dict[str, Any]:
        """Collect everything that determines the results, for JSON: all parameters, files by sha256."""
        params, count, parameters = self.params, len(self.encoders), []
        for _, _, _, varied, robot in self.cells[: len(self.cells) // len(self.tests)]:
            parts = {name: part.model_dump(mode='json') for name, part in robot._asdict().items()}
            # So that older campaigns can be completed:
            if robot.simulator.imu is None:
                del parts['simulator']['imu'], parts['fusion']
            if robot.simulator.wheel_errors.slip == WheelSlipParams():
                del parts['simulator']['wheel_errors']['slip']
            parameters.append({'varied': dict(varied), **parts})
        # Of real encoders, the parameters by dotted keys that differ from the first encoder, for each combination.
        firsts, changes = [dict(flat(first)) for first in parameters[::count]], []
        for column, encoder in enumerate(self.encoders):
            if encoder.real:
                pairs = zip(firsts, parameters[column::count])
                own = [{key: value for key, value in flat(each) if first.get(key) != value} for first, each in pairs]
                changes.append({'label': encoder.label, 'parameters': own})
        return {
            'tests': [{**test.model_dump(mode='json'), 'files': self.files.worlds[test.name]} for test in self.tests],
            'parameters': parameters[::count],
            'ppr': [ppr.model_dump(mode='json') for ppr in params.ppr],
            **({'encoders': changes} if params.encoders else {}),
            'trials': params.trials,
            'seed': params.seed,
            'nav': params.nav,
            'record': params.record,
            # Without defaults, so that older campaigns can be completed.
            **params.model_dump(mode='json', include=set(LockstepOptions.model_fields), exclude_defaults=True),
            'robot': str(self.files.robot),
            'files': self.files.sha256(),
        }

    def fingerprint(self) -> str:
        """Compute the sha256 of `resolved`: campaigns of equal fingerprints have equal results."""
        return hashlib.sha256(json.dumps(self.resolved(), sort_keys=True, allow_nan=False).encode('utf-8')).hexdigest()

    def manifest(self) -> Dict[str, Any]:
        """Return the content of manifest.json, except for the runs."""
        params, file, description = self.params, self.robot.file, self.robot.description
        robot = {
            'name': self.robot.name,
            'file': file.where,
            'arguments': dict(file.source.arguments),
            'ppr': file.ppr,
            'found': [row._asdict() for row in description.found],
            'set': file.overrides,
            'warnings': list(description.warnings),
            'notes': list(description.notes),
            'checks': [check._asdict() for check in self.checks],
        }
        diameter = self.cells[0].robot_params.odometry.wheel_diameter
        encoders = [
            {
                'label': encoder.label,
                'name': encoder.real.name,
                'source': list(encoder.real.source),
                'price': encoder.real.price,
                'resolution': encoder.resolution,
                'counts_per_metre': encoder.counts_per_metre(diameter),
            }
            for encoder in self.encoders
            if encoder.real
        ]
        return {
            'name': params.name,
            'fingerprint': self.fingerprint(),
            'seeds': {'first': params.seed + 1, 'last': params.seed + params.trials},
            'robot': robot,
            **({'encoders': encoders} if params.encoders else {}),
            **({'config_files': dict(params.files)} if params.files else {}),
            'configuration': self.resolved(),
        }


def text_of(value: Any) -> str:
    """Return a parameter's value in one printable line."""
    return value if isinstance(value, str) and value.isprintable() else json.dumps(value)


def check_robot(source: RobotSource, params: SimulatorParams) -> List[Check]:
    """Drive a robot on a flat floor, without the parameters' wheel errors; ConfigError if its description is bad."""
    return self_check(load_simulated_robot(source, params.choices()), params)


def unfit_tests(campaign: Campaign, worlds_folder: Path) -> List[str]:
    """Return why the robot cannot run tests, one line per test; empty for drives without feedback."""
    if campaign.params.nav == 'scripted':
        return []
    found: Dict[str, Optional[str]] = {}
    for _, test, _, _, params in campaign.cells[:: len(campaign.encoders)]:
        if test.route and not found.get(test.name):
            grid = load_map(find_world(test.world, worlds_folder).with_suffix('.yaml'))
            found[test.name] = misfit(test, params.navigator, params.simulator.drive, grid)
    return [line for line in found.values() if line]
