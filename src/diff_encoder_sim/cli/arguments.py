"""Command lines of declared options."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path
from typing import Any, Dict, Optional, Sequence, Type, TypeVar

from diff_encoder_sim.base.command_line import number_within, tool_parser

Options = TypeVar('Options')


def read_options(kind: Type[Options], arguments: Optional[Sequence[str]] = None, **texts: Any) -> Options:
    """Return options of class `kind`, with an `option` per argument of a command line; `texts` as in `tool_parser`."""
    parser = tool_parser(**texts)
    groups: Dict[str, argparse._ActionsContainer] = {'': parser}
    for each in fields(kind):  # type: ignore[arg-type] # a dataclass
        if not each.metadata:
            continue
        argument, title = dict(each.metadata['argument']), each.metadata['group']
        flag = each.metadata['flag'] or f'--{each.name.replace("_", "-")}'
        argument['default'] = each.default
        if flag.startswith('-'):
            argument.update({'dest': each.name, 'default': argparse.SUPPRESS})
        if each.type == 'bool':
            argument = {'action': 'store_true', **argument}
            del argument['metavar']
        elif 'Path' in each.type:
            argument['type'] = Path
        elif each.metadata['bounds']:
            argument['type'] = number_within(each.metadata['bounds'], int if 'int' in each.type else float)
        if 'Sequence' in each.type and 'action' not in argument:
            argument.setdefault('nargs', '+')
        if title not in groups:
            groups[title] = parser.add_argument_group(title)
        groups[title].add_argument(flag, **argument)
    return kind(**vars(parser.parse_args(arguments)))
