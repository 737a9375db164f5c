"""Values for XML-RPC, which has 32-bit integers."""

from __future__ import annotations

import re
from typing import Any, Mapping

LARGEST_INT = 2**31 - 1


def for_xml_rpc(value: Any) -> Any:
    """Return a value with large integers as text, also in mappings and lists."""
    if isinstance(value, Mapping):
        return {key: for_xml_rpc(each) for key, each in value.items()}
    if isinstance(value, list):
        return [for_xml_rpc(each) for each in value]
    is_large = isinstance(value, int) and abs(value) > LARGEST_INT
    return str(value) if is_large else value


def from_xml_rpc(value: Any) -> Any:
    """Reverse `for_xml_rpc`."""
    if isinstance(value, Mapping):
        return {key: from_xml_rpc(each) for key, each in value.items()}
    if isinstance(value, list):
        return [from_xml_rpc(each) for each in value]
    is_large = isinstance(value, str) and re.fullmatch('-?[1-9][0-9]{9,18}', value) is not None
    return int(value) if is_large else value
