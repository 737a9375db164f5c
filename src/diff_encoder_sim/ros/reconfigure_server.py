"""A server of ROS's dynamic_reconfigure, without the code that is generated from .cfg files.

Importing it needs the package dynamic_reconfigure.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Callable, Dict, Sequence

import rospy
from dynamic_reconfigure.server import Server

from diff_encoder_sim.base.errors import EVENT, ConfigError
from diff_encoder_sim.ros.adjustable import RESTORE_DEFAULTS, Adjustable
from diff_encoder_sim.ros.node import log

Change = Callable[[Dict[str, Any]], None]


class ReconfigureServer(Server):  # type: ignore[misc]  # the library has no types
    """Offers parameters of a namespace, and hands on what changes.

    Args:
        namespace: `~`, or below it such as `~global_costmap`.
        adjustables: the parameters, with the values in force.
        change: is called with the values that all of them shall have, and raises ConfigError where these are refused.
    """

    def __init__(self, namespace: str, adjustables: Sequence[Adjustable], change: Change) -> None:
        self._adjustables, self._change = adjustables, change
        self._at_start = {each.name: each.value for each in adjustables}
        self._values = self._stored = self._at_start
        super().__init__(_description(adjustables), self._on_change, '' if namespace == '~' else namespace)

    def _on_change(self, config: Dict[str, Any], _level: int) -> Dict[str, Any]:
        """Take the values that a client has set, or keep the old ones; the client is told which are in force."""
        wanted = {name: config[name] for name in self._values}
        if wanted.get(RESTORE_DEFAULTS) is True:
            wanted = self._at_start
        changes = ', '.join(f'{name} {value}' for name, value in wanted.items() if value != self._values[name])
        if changes:
            try:
                self._change(wanted)
                self._values = wanted
                log.info('changed in %s: %s', rospy.resolve_name(self.ns), changes, extra=EVENT)
            except ConfigError as error:
                log.warning('not changed: %s', error, extra=EVENT)
        return type(config)({**self._values, 'groups': config['groups']})

    def _copy_from_parameter_server(self) -> None:
        """Leave the values as they are: the node has read and checked its parameters itself."""

    def _copy_to_parameter_server(self) -> None:
        """Store what has changed, so that a node that is started again begins with it."""
        for name, value in self._values.items():
            if value != self._stored[name]:
                rospy.set_param(self.ns + name, value)
        self._stored = self._values

    def _clamp(self, config: Dict[str, Any]) -> None:
        """Bring numbers within their limits; what is no number is refused afterwards, for its type."""
        for each in self._adjustables:
            value = config[each.name]
            if isinstance(value, (int, float)) and isinstance(each.least, (int, float)):
                config[each.name] = min(max(value, each.least), each.most)


def _description(adjustables: Sequence[Adjustable]) -> SimpleNamespace:
    """Return what the library otherwise takes from a generated module."""
    group = {'name': 'Default', 'type': '', 'state': True, 'id': 0, 'parent': 0, 'groups': []}
    group['parameters'] = [
        {
            'name': each.name,
            'type': each.type_name,
            'default': each.value,
            'min': each.least,
            'max': each.most,
            'level': 0,
            'description': each.description,
            'edit_method': _choice(each) if each.choices else '',
        }
        for each in adjustables
    ]
    return SimpleNamespace(
        config_description=group,
        defaults={each.name: each.value for each in adjustables},
        min={each.name: each.least for each in adjustables},
        max={each.name: each.most for each in adjustables},
        level={each.name: 0 for each in adjustables},
        type={each.name: each.type_name for each in adjustables},
        all_level=0,
    )


def _choice(adjustable: Adjustable) -> str:
    """Return what rqt_reconfigure makes a list to choose from."""
    choices = [
        {'name': str(choice), 'type': adjustable.type_name, 'value': choice, 'description': ''}
        for choice in adjustable.choices
    ]
    return repr({'enum': choices, 'enum_description': adjustable.description})
