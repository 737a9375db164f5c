"""A robot as users describe theirs: its URDF, and what differs from the files of config/."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, NamedTuple

from pydantic import Field

from diff_encoder_sim.base.typed_params import Params, load_params


class RobotFileParams(Params):
    """The keys of a robot file; config/alto.yaml is the pattern."""

    urdf: str = Field(min_length=1, description='xacro or URDF file, relative to this file')
    overrides: Dict[str, Any] = Field({}, alias='set', description='values of parameters, by dotted keys')


class Robot(NamedTuple):
    """A robot's own files and numbers."""

    urdf: Path
    overrides: Dict[str, Any]  # by dotted keys, as robot_params.override takes them


def load_robot_file(path: Path) -> Robot:
    """Load a robot by its YAML file, or by its xacro or URDF alone.

    Raises:
        ConfigError: the YAML file cannot be read or has a bad key.
    """
    if path.suffix not in ('.yaml', '.yml'):
        return Robot(path, {})
    params = load_params(RobotFileParams, path)
    return Robot(path.parent / params.urdf, dict(params.overrides))
