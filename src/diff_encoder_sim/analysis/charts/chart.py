"""What a page's charts are made of: Vega-Lite specifications, their data, and what its reader may choose."""

from __future__ import annotations

import enum
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Union

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
    colour: str = ''  # in which charts draw it, as CSS has it


class Choice(NamedTuple):
    """What the reader of a page may choose: a parameter of all its charts, by its name."""

    name: str
    label: str
    options: Sequence[Option]
    chosen: Union[str, int, List[Union[str, int]]]  # at first; a list of values for boxes
    look: Look
    # A click on a mark whose data has a field of the choice's name chooses its value, and this chart comes into view.
    clicked_for: str = ''
