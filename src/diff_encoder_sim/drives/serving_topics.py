"""Usable topics of a bag without wheel angles, as options to type."""

from __future__ import annotations

import contextlib
import re
import shlex
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.message_fields import message_type, number_paths
from diff_encoder_sim.drives.message_types import ODOMETRY, TRANSFORMS
from diff_encoder_sim.drives.number_units import TICKS
from diff_encoder_sim.drives.reference import ARROW
from diff_encoder_sim.drives.topics import TF

_LISTED = 5

# A name of the left wheel becomes the right one's by one of these.
_MIRRORED = (
    ('left', 'right'),
    ('Left', 'Right'),
    ('LEFT', 'RIGHT'),
    ('lwheel', 'rwheel'),
    ('l_', 'r_'),
    ('_l', '_r'),
    ('[0]', '[1]'),
)
# Elements of an array are both wheels only where its name is about wheels.
_OF_WHEELS = re.compile('tick|enc|count|wheel|drive|motor')
# By the first of these in a name, the unit that it is likely in; empty where it is about no turning of wheels.
_UNITS_BY_WORD = (
    (
        'cmd|target|command|setpoint|desired|current|temp|pwm|duty|cliff|bump|drop|layout|time|covariance|imu|scan|resolution',
        '',
    ),
    ('tick|encoder|count|enc_', TICKS),
    ('rpm', 'rpm'),
    ('travel|position|angle', 'rad'),
    ('vel|speed', 'rad/s'),
    ('dist|odo', 'm'),
    ('wheel', TICKS),
)


class _Pair(NamedTuple):
    left: str
    right: str
    unit: str

    @property
    def option(self) -> str:
        about = '--ticks-per-revolution N' if self.unit == TICKS else f'--unit {self.unit}'
        return f'--ticks {shlex.quote(self.left)} {shlex.quote(self.right)} {about}'


def serving_options(path: Path, source: BagSource) -> List[str]:
    """List options by which wheel angles can be had from a bag, the likeliest first."""
    pairs = sorted(_pairs(path, source), key=lambda pair: ([TICKS, 'rad', 'm', 'rad/s', 'rpm'].index(pair.unit), pair))
    poses = sorted(topic for topic, kind in source.topics.items() if kind == ODOMETRY)
    if not poses and source.topics.get(TF) == TRANSFORMS:
        poses = [shlex.quote(f'odom{ARROW}base_link')]
    return [*(pair.option for pair in pairs[:_LISTED]), *(f'--odom {each}' for each in poses[:_LISTED])]


def _pairs(path: Path, source: BagSource) -> Iterator[_Pair]:
    names = dict.fromkeys(_numbers(path, source))
    for left in names:
        right = _mirrored(left, names)
        unit = _unit(left)
        if right and unit:
            yield _Pair(left, right, unit)


def _numbers(path: Path, source: BagSource) -> Iterator[str]:
    """List all numbers in the messages of a bag, as users name them."""
    for topic in source.topics:
        with contextlib.suppress(ConfigError):  # of a type that nobody defines
            found = message_type(path, source, topic)
            for text in number_paths(found.fields, found.name):
                yield topic if text == '.data' else topic + text


def _mirrored(left: str, names: Dict[str, None]) -> str:
    words_in_it = [
        words for words in _MIRRORED if words[0] in left and (words[0] != '[0]' or _OF_WHEELS.search(left.lower()))
    ]
    candidates = (left.replace(*words) for words in words_in_it)
    return next((right for right in candidates if right in names), '')


def _unit(name: str) -> str:
    return next((unit for words, unit in _UNITS_BY_WORD if re.search(words, name.lower())), '')
