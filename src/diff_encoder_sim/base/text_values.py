"""Values for XML-RPC, whose whole numbers have 32 bits."""

from __future__ import annotations

import re
from typing import Any, Mapping

LARGEST_INT = 2**31 - 1


def for_xml_rpc(value: Any) -> Any:
    """Return a value with its large whole numbers as text, those in mappings and lists, too."""
    if isinstance(value, Mapping):
        return {key: for_xml_rpc(each) for key, each in value.items()}
    if isinstance(value, list):
        return [for_xml_rpc(each) for each in value]
    is_large = isinstance(value, int) and abs(value) > LARGEST_INT
    return str(value) if is_large else value


def from_xml_rpc(value: Any) -> Any:
    """Return what `for_xml_rpc` was given."""
    if isinstance(value, Mapping):
        return {key: from_xml_rpc(each) for key, each in value.items()}
    if isinstance(value, list):
        return [from_xml_rpc(each) for each in value]
    is_large = isinstance(value, str) and re.fullmatch('-?[1-9][0-9]{9,18}', value) is not None
    return int(value) if is_large else value
