"""Mapping files: how the suite starts, feeds and resets an odometry node, and where its odometry is."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Literal, Mapping, NamedTuple, Union

from pydantic import Field, field_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between, Length_m, PulsesPerTurn
from diff_encoder_sim.base.params import Line, Params, param
from diff_encoder_sim.drives.field_wheels import split_address

COUNTS, ANGLES = ('left_count', 'right_count'), ('left_rad', 'right_rad')
QUANTITIES = (*COUNTS, *ANGLES, 'left_radps', 'right_radps', 'linear_mps', 'angular_radps')
Number = Union[int, float, str]


class NodeMapping(Params):
    """A mapping file (config/conformance/)."""

    about: Line = param('', 'the node, and whether and how this file was run')
    command: Union[Line, List[Line]] = param('', 'starts the node, one or more processes; empty: it is running')
    input: Dict[str, Number] = Field(
        description=f'quantity (one of {", ".join(QUANTITIES)}) or constant by address TOPIC.field[0], as in --ticks'
    )
    parameters: Dict[str, Any] = param(
        {}, 'parameters by node, set before each start; {ppr} and others in texts are values of the robot'
    )
    odom: Line = param('/odom', 'topic of the odometry')
    odom_frame: Line = param('odom', 'its frame')
    base_frame: Line = param('base_link', 'its child frame')
    publish_tf: bool = param(True, 'whether the node publishes odom_frame -> base_frame on /tf')
    reset: Line = param('', 'service (std_srvs/Empty) that resets the pose to zero; empty: none')
    encoder: bool = param(True, 'whether a node that reads angles counts them first, by equation (1)')
    first_count: Annotated[int, Between(0, 2**31)] = param(0, 'of both wheels, for unsigned counters')
    counter_bits: List[Literal[8, 16, 32]] = param([], 'widths of the counters that the node is tested with')
    sets_counter: bool = param(False, 'whether parameters set the width; false: the counters have the only width')
    sets_noise: bool = param(False, 'whether parameters set the noise of the covariance')
    pace: Literal['fast', 'realtime'] = param('fast', 'realtime for nodes with a timer, and for inputs without stamps')
    rate: Annotated[float, Between(1.0, 1000.0, 'Hz')] = param(20.0, 'of the input and of the odometry [Hz]')
    start_timeout: Annotated[float, Between(1.0, 60.0, 's')] = param(10.0, 'until the first odometry [s]')

    @field_validator('input')
    @classmethod
    def _has_both_wheels(cls, given: Dict[str, Number]) -> Dict[str, Number]:
        values, wrong = set(given.values()), [address for address in given if not split_address(address)[0]]
        if wrong:
            raise ValueError(f'TOPIC.field[0] in place of {wrong[0]}')
        if not any(values.issuperset(pair) for pair in (COUNTS, ANGLES, QUANTITIES[-2:])):
            raise ValueError('addresses of left_count and right_count, left_rad and right_rad, or of both speeds')
        return given

    @property
    def commands(self) -> List[str]:
        """Return the command lines."""
        return [self.command] * bool(self.command) if isinstance(self.command, str) else self.command

    @property
    def reads_counts(self) -> bool:
        """Return whether the input has counts, which wrap and restart; else angles or speeds."""
        return not set(COUNTS).isdisjoint(self.input.values())

    @property
    def is_exact(self) -> bool:
        """Return whether the pose follows from whole counts."""
        return self.reads_counts or (self.encoder and not set(ANGLES).isdisjoint(self.input.values()))


class Wheels(Params):
    """Both wheels of the robot of all cases, as the node assumes them."""

    ppr: PulsesPerTurn = param(1024.0, 'counts per wheel revolution')
    wheel_diameter: Length_m = param(0.2, '[m]')
    wheel_separation: Length_m = param(0.4, 'between the contact points [m]')

    @property
    def m_per_count(self) -> float:
        """Return the distance of one count [m]."""
        return math.pi * self.wheel_diameter / self.ppr


class Settings(NamedTuple):
    """Values of a round: parameters of a node may depend on them."""

    modulus: int  # of the counters; 0: they do not wrap
    motion_noise_m2_per_m: float  # variance of the travel of a wheel per metre of it


def parameters_of(mapping: NodeMapping, wheels: Wheels, settings: Settings) -> Dict[str, Any]:
    """Return the parameters by node, with the values of the robot in place of texts such as {ppr}."""
    values = {
        **wheels.model_dump(),
        'wheel_radius': 0.5 * wheels.wheel_diameter,
        'm_per_count': wheels.m_per_count,
        'counts_per_m': 1.0 / wheels.m_per_count,
        'counter_modulus': settings.modulus,
        'counter_min': -(settings.modulus // 2),
        'counter_max': settings.modulus // 2 - 1,
        'motion_noise': settings.motion_noise_m2_per_m,
        'rate': mapping.rate,
    }
    return {node: _filled(parameters, values) for node, parameters in mapping.parameters.items()}


def _filled(given: Any, values: Mapping[str, Any]) -> Any:
    if isinstance(given, Mapping):
        return {key: _filled(value, values) for key, value in given.items()}
    is_value = isinstance(given, str) and given.startswith('{') and given.endswith('}')
    return values.get(given[1:-1], given) if is_value else given
