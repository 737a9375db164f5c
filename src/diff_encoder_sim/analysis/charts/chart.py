"""What a page's charts are made of: Vega-Lite specifications, their data, and what its reader may choose."""

from __future__ import annotations

import enum
from typing import Any, Dict, Mapping, NamedTuple, Sequence, Union

# By name, as specifications refer to them: rows with equal keys. Numbers are finite or None.
Data = Mapping[str, Sequence[Mapping[str, Any]]]

# In the `params` of a specification, or of the layer whose axes it is to zoom: drag, Ctrl with the wheel, and buttons.
ZOOM: Dict[str, Any] = {
    'name': 'zoom',
    'select': {'type': 'interval', 'zoom': 'wheel![event.ctrlKey || event.metaKey]'},
    'bind': 'scales',
}


class Chart(NamedTuple):
    """One chart.

    The specification names its data, {'data': {'name': 'trials'}}, and has neither width nor title; it may use the
    page's choices as parameters: {'filter': 'indexof(encoders, datum.encoder) >= 0'}.
    """

    name: str  # unique in the page; of letters, digits and hyphens
    title: str
    description: str  # what it shows and how it is read, for all readers and screen readers
    spec: Dict[str, Any]  # Vega-Lite
    table: str = ''  # id of the page's element that has the numbers; '' where there is none


class Look(enum.Enum):
    """How a choice is shown."""

    BOXES = 'checkbox'  # any number of options
    BUTTONS = 'radio'  # one of a few
    LIST = 'select'  # one of many


class Option(NamedTuple):
    """One value of a choice."""

    value: Union[str, int]
    label: str
    colour: str = ''  # in which charts draw it, as CSS has it; '' where it has none
    symbol: str = '●'  # that charts draw for it, where it has a colour
    within: Union[str, int, None] = None  # offered while the choice that its own is `within` has this value


class Choice(NamedTuple):
    """What the reader of a page may choose: a parameter of all its charts, by its name."""

    name: str
    label: str
    options: Sequence[Option]
    chosen: Union[str, int, Sequence[Union[str, int]]]  # at first; several values for boxes
    look: Look
    within: str = ''  # of a list: the name of another choice, whose values its options are within
    # Of a list: a click on a mark whose data has a field of its name chooses that value, and brings this chart into
    # view. So does one on a hidden element of the page with `data-choose`, values by name as JSON.
    clicked_for: str = ''
