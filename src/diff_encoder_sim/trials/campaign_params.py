"""The keys of a campaign file."""

from __future__ import annotations

import itertools
import math
from typing import Any, Dict, Iterator, List, Literal, Tuple

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import Between
from diff_encoder_sim.base.file_names import Line, PathLine
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.drives.bag_formats import BagFormat
from diff_encoder_sim.drives.topics import RecordMode
from diff_encoder_sim.trials.campaign_sizes import TRIALS
from diff_encoder_sim.wheels.pulses import PulsesPerRevolution

Varied = Tuple[Tuple[str, Any], ...]  # dotted keys, or VARIANT, in alphabetical order, and values
VARIANT = 'variant'  # in place of a key: the value is the name of one of the file's `variants`


ConfigFile = Literal['amcl', 'config', 'lockstep', 'navigation', 'simulator']  # stems of files of config/


class CampaignParams(Params):
    """The keys of a campaign file."""

    name: Line = Field(min_length=1, description='name of the campaign')
    tests: List[PathLine] = Field(min_length=1, description='names of files in config/tests/, or paths of .yaml files')
    ppr: List[PulsesPerRevolution] = Field([], description='ideal encoders, in pulses per wheel revolution')
    encoders: List[PathLine] = Field(
        [],
        description='real encoders, beside those of `ppr` or alone: names of files in config/encoders/, paths of .yaml '
        'files, or `catalogue` for all of config/encoders/',
    )
    trials: Annotated[int, TRIALS] = Field(30, description='trials of each test with each encoder')
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
    variants: Dict[Annotated[Line, Field(min_length=1)], Dict[Line, Any]] = Field(
        {},
        description='sets of values of parameters by names: each is a cell of its own; others are compared with the '
        'first; they come before `set`',
    )

    @property
    def varied_keys(self) -> List[str]:
        """Return what is varied, each a column of trials.csv: dotted keys of parameters, and VARIANT."""
        return sorted([*self.vary, *([VARIANT] if self.variants else [])])

    def combinations(self) -> Iterator[Varied]:
        """Yield the combinations of varied parameters; one empty combination where nothing is varied."""
        values = {**self.vary, VARIANT: list(self.variants)}
        for combination in itertools.product(*(values[key] for key in self.varied_keys)):
            yield tuple(zip(self.varied_keys, combination))

    def combination_count(self) -> int:
        """Count them without creating them."""
        return math.prod([len(self.variants) or 1, *map(len, self.vary.values())])

    def values_of(self, varied: Varied) -> Dict[str, Any]:
        """Return the values of parameters, by dotted keys, in one of the combinations."""
        values = {**self.overrides, **dict(varied)}
        variant = values.pop(VARIANT, None)
        return values if variant is None else {**values, **self.variants[variant]}
