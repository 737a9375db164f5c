"""YAML files and arguments: read as in ROS (YAML 1.1), without its ambiguous values.

YAML 1.1 reads `0100` as 64, `1:30` as 90, `on` as true, and keeps the last of equal keys. These are errors here,
with the line.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Callable, Dict, Hashable, Union

import yaml
from yaml.constructor import SafeConstructor
from yaml.nodes import MappingNode, ScalarNode

from diff_encoder_sim.base.errors import ConfigError

try:
    from yaml import CSafeLoader as SafeLoader  # 20 times as fast
except ImportError:
    from yaml import SafeLoader  # type: ignore[assignment]

# Values with the same meaning in YAML 1.1 and 1.2.
_PLAIN = {
    'int': re.compile(r'[-+]?(0|[1-9][0-9]*|0x[0-9a-fA-F]+)'),
    'float': re.compile(r'[-+]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][-+][0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)'),
    'bool': re.compile(r'true|True|TRUE|false|False|FALSE'),
    'timestamp': re.compile(r'(?!)'),  # parameters are not dates
}


class RefusedYaml(yaml.constructor.ConstructorError):
    """Valid but ambiguous YAML."""

    def __init__(self, problem: str, node: yaml.Node) -> None:
        super().__init__(None, None, problem, node.start_mark)


class StrictLoader(SafeLoader):
    """PyYAML's safe loader, which rejects ambiguous values."""

    def construct_mapping(self, node: MappingNode, deep: bool = False) -> Dict[Hashable, Any]:
        """Construct a mapping with unique text keys."""
        lines: Dict[str, int] = {}
        for key, _ in node.value:
            if key.tag not in ('tag:yaml.org,2002:str', 'tag:yaml.org,2002:merge'):
                raise RefusedYaml(f'given the key {_shown(key)}; allowed: text, or in quotes', key)
            if key.value in lines:
                text = f'{_shown(key)}: given twice, first in line {lines[key.value]}; allowed: each key once'
                raise RefusedYaml(text, key)
            lines[key.value] = key.start_mark.line + 1
        return super().construct_mapping(node, deep)


def _constructor(kind: str) -> Callable[[StrictLoader, ScalarNode], Any]:
    """Return the constructor of a kind of scalar that rejects ambiguous values."""
    construct = SafeConstructor.yaml_constructors[f'tag:yaml.org,2002:{kind}']

    def construct_plain(loader: StrictLoader, node: ScalarNode) -> Any:
        try:
            value = construct(loader, node)
        except (ValueError, KeyError):
            raise RefusedYaml(f'given {_shown(node)}; allowed: a number, or text in quotes', node) from None
        if _PLAIN[kind].fullmatch(node.value):
            return value
        parsed, allowed = str(value).lower(), f'{str(value).lower()}, or text in quotes'
        if kind == 'timestamp':
            parsed, allowed = 'a date', 'text in quotes'
        raise RefusedYaml(f'given {_shown(node)}, which YAML 1.1 takes for {parsed}; allowed: {allowed}', node)

    return construct_plain


for _kind in _PLAIN:
    StrictLoader.add_constructor(f'tag:yaml.org,2002:{_kind}', _constructor(_kind))


def load_yaml(path: Union[str, Path]) -> Dict[str, Any]:
    """Read the mapping in a YAML file, {} if empty; ConfigError if unreadable, ambiguous or no mapping."""
    try:
        content = yaml.load(Path(path).read_text(encoding='utf-8'), Loader=StrictLoader)
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else 'not UTF-8 text'
        raise ConfigError(f'{path}: cannot be read: {reason}') from None
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        where = f'{path}, line {mark.line + 1}' if mark else str(path)
        text = getattr(error, 'problem', None) or getattr(error, 'reason', None) or 'cannot be parsed'
        raise ConfigError(f'{where}: {text if isinstance(error, RefusedYaml) else f"not valid YAML: {text}"}') from None
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise ConfigError(f'{path}: given a {type(content).__name__}; allowed: a mapping (key: value)')
    return content


def find_yaml(key: str, given: str, named_folder: Path, folder: Path = Path(), stems: str = '*') -> Path:
    """Return the path of a .yaml file in `folder`, or a name in `named_folder`; ConfigError lists those by `stems`."""
    path = folder / given if given.endswith('.yaml') else named_folder / f'{given}.yaml'
    if not path.is_file():
        known = ', '.join(sorted(file.stem for file in named_folder.glob(f'{stems}.yaml')))
        raise ConfigError(f'{key}: given {given!r}; allowed: {known}, or a .yaml file')
    return path


def yaml_value(text: str, source: str) -> Any:
    """Read an argument as roslaunch does, invalid YAML as text; ConfigError, which names `source`, if ambiguous."""
    try:
        return yaml.load(text, Loader=StrictLoader)
    except RefusedYaml as error:
        raise ConfigError(f'{source}: {error.problem}') from None
    except yaml.YAMLError:
        return text


def _shown(node: yaml.Node) -> str:
    if not isinstance(node, ScalarNode):
        return 'that is a list or a mapping'
    text = str(node.value)
    return text if len(text) < 60 else f'{text[:57]!r}...'
