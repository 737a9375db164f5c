"""Arguments of a robot's xacro as users type them: name:=value."""

from __future__ import annotations

import shlex
from typing import Dict, Sequence

from diff_encoder_sim.base.errors import ConfigError


def xacro_arguments(words: Sequence[str], where: str = '--robot-arg') -> Dict[str, str]:
    """Read arguments of a xacro.

    Raises:
        ConfigError: one is not NAME:=VALUE, or a name comes twice.
    """
    arguments: Dict[str, str] = {}
    for word in words:
        name, separator, value = word.partition(':=')
        if not (name and separator):
            raise ConfigError(f'{where}: given {word!r}; allowed: name:=value')
        if name in arguments:
            raise ConfigError(f'{where}: given {name!r} twice; allowed: once')
        arguments[name] = value
    return arguments


def xacro_arguments_of_text(text: str) -> Dict[str, str]:
    """Read the launch argument robot_args: name=value, as roslaunch passes no := within a value.

    Raises:
        ConfigError: it is not such pairs, separated by blanks.
    """
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise ConfigError(f'robot_args: given {text!r}: {error}; allowed: name=value name=value') from None
    return xacro_arguments([word if ':=' in word else word.replace('=', ':=', 1) for word in words], 'robot_args')
