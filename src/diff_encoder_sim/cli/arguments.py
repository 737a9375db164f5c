"""Command lines of declared options."""

from __future__ import annotations

import argparse
from dataclasses import fields
from typing import Dict, Optional, Sequence, Type, TypeVar

from diff_encoder_sim.base.command_line import tool_parser

Options = TypeVar('Options')


def read_options(
    kind: Type[Options],
    arguments: Optional[Sequence[str]],
    name: str,
    description: str,
    examples: Sequence[str],
    notes: str = '',
) -> Options:
    """Return the options of a command line.

    Args:
        kind: class with an `option` per argument.
        arguments: words of the command line; by default those of the process.
        name: of the command; like all that follow, as in `tool_parser`.
        description: paragraphs.
        examples: arguments of whole commands.
        notes: paragraphs after the options.
    """
    parser = tool_parser(name, description, examples, notes)
    groups: Dict[str, argparse._ActionsContainer] = {'': parser}
    for each in fields(kind):  # type: ignore[arg-type] # a dataclass
        if each.metadata:
            title, flag = each.metadata['group'], each.metadata['flag'] or f'--{each.name.replace("_", "-")}'
            if title not in groups:
                groups[title] = parser.add_argument_group(title)
            is_positional = not flag.startswith('-')
            named = {'default': each.default} if is_positional else {'default': argparse.SUPPRESS, 'dest': each.name}
            groups[title].add_argument(flag, **named, **each.metadata['argument'])
    return kind(**vars(parser.parse_args(arguments)))
