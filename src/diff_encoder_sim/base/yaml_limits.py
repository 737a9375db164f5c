"""How large and how deep YAML may be, aliases written out: a file of 500 bytes can mean gigabytes.

libyaml's composer calls itself for each level and ends the process where its stack is full, so this is checked
before, on the events.
"""

from __future__ import annotations

from typing import Any, Dict, Iterable, List, NamedTuple, Optional

import yaml

MOST_NODES, DEEPEST = 100_000, 50


class _Extent(NamedTuple):
    nodes: int
    levels: int


_SCALAR = _Extent(1, 0)


class OversizedYaml(yaml.MarkedYAMLError):
    """YAML with too many values, or nested too deep."""

    def __init__(self, problem: str, mark: Any) -> None:
        super().__init__(None, None, problem, mark)


def check_size(events: Iterable[yaml.Event]) -> None:
    """Read the events of a text to their end.

    Raises:
        OversizedYaml: the text is too deep or too large, or something contains itself.
        yaml.YAMLError: it is not YAML.
    """
    known: Dict[str, _Extent] = {}
    open_anchors: List[Optional[str]] = []
    extents = [_Extent(0, 0)]  # of the text, and of each collection that is open
    for event in events:
        if isinstance(event, yaml.CollectionStartEvent):
            open_anchors.append(event.anchor)
            extents.append(_SCALAR)
        elif isinstance(event, yaml.CollectionEndEvent):
            extent = extents.pop()
            _add(extents, _Extent(extent.nodes, extent.levels + 1), open_anchors.pop(), known)
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor in open_anchors:
                raise OversizedYaml(f'*{event.anchor} contains itself', event.start_mark)
            _add(extents, known.get(event.anchor or '', _SCALAR), None, known)
        elif isinstance(event, yaml.ScalarEvent):
            _add(extents, _SCALAR, event.anchor, known)
        if len(open_anchors) + extents[-1].levels > DEEPEST:
            raise OversizedYaml(f'nested deeper than {DEEPEST} levels', event.start_mark)
        if extents[-1].nodes > MOST_NODES:
            raise OversizedYaml(f'more than {MOST_NODES:,} values, with aliases written out', event.start_mark)


def _add(extents: List[_Extent], extent: _Extent, anchor: Optional[str], known: Dict[str, _Extent]) -> None:
    """Add a node to what contains it, and remember what its aliases stand for."""
    outer = extents[-1]
    extents[-1] = _Extent(outer.nodes + extent.nodes, max(outer.levels, extent.levels))
    if anchor is not None:
        known[anchor] = extent
