"""Dynamic reconfiguration of node parameters (rqt_reconfigure, dynparam), with the names and limits of cfg/."""

from __future__ import annotations

from functools import partial
from types import ModuleType
from typing import Any, Callable, Dict, Mapping

import rospy
from dynamic_reconfigure.server import Server

from diff_encoder_sim.base.errors import EVENT, ConfigError
from diff_encoder_sim.base.params import with_changes
from diff_encoder_sim.cfg import (
    AMCLConfig,
    Costmap2DConfig,
    DWAPlannerConfig,
    InflationPluginConfig,
    MoveBaseConfig,
    ObstaclePluginConfig,
)
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.ros.node import log, one_at_a_time

Values = Dict[str, Any]

# Topics and frames of amcl_node, which are fixed at its start.
FIXED = ('odom_frame_id', 'base_frame_id', 'global_frame_id', 'use_map_topic')
ROBOT_RADIUS_M = 0.46  # upstream's default of robot_radius, used if the footprint is []


class ReconfigureServer(Server):  # type: ignore[misc]  # the library has no types
    """Server of a namespace in the node's, which starts with the node's `values` and stores changed ones.

    The library would clamp parameters to the limits of the .cfg file at the start; here the node validates its values.
    `change` is called with all values after a change, and raises ConfigError to refuse them.
    """

    def __init__(
        self, config_type: ModuleType, namespace: str, values: Mapping[str, Any], change: Callable[[Values], None]
    ) -> None:
        self._change = change
        self._at_start = self._values = {name: values[name] for name in config_type.defaults}
        super().__init__(config_type, one_at_a_time(self._on_change), namespace)

    def _on_change(self, config: Any, _level: int) -> Any:
        """Apply or refuse a client's values, and return the values in use."""
        wanted = {name: config[name] for name in self._values}
        if wanted.get('restore_defaults'):
            wanted = self._at_start
        changes = {name: value for name, value in wanted.items() if value != self._values[name]}
        if changes and hasattr(self, 'set_service'):
            try:
                self._change(wanted)
            except ConfigError as error:
                log.warning('not changed: %s', error, extra=EVENT)
            else:
                self._values = wanted
                for name, value in changes.items():
                    rospy.set_param(self.ns + name, value)
                text = ', '.join(f'{name} {value}' for name, value in changes.items())
                log.info('changed in %s: %s', rospy.resolve_name(self.ns), text, extra=EVENT)
        config.update(self._values)
        return config

    def _copy_from_parameter_server(self) -> None:
        self.config.update(self._values)

    def _copy_to_parameter_server(self) -> None:
        """Keep what `_on_change` has stored: the library would store every value."""


def serve_amcl(params: AmclParams, apply: Callable[[Any], None]) -> None:
    """Serve the parameters of amcl_node; `apply` receives the validated parameters after a change."""

    def change(values: Values) -> None:
        for name in FIXED:
            if values[name] != getattr(params, name):
                allowed = f'{getattr(params, name)!r} until the node restarts'
                raise ConfigError(f'{name}: given {values[name]!r}; allowed: {allowed}')
        apply(with_changes(params, values, ''))

    ReconfigureServer(AMCLConfig, '', dict(params), change)


def serve_navigation(params: NavigatorParams, apply: Callable[[NavigatorParams], None]) -> None:
    """Serve the parameters of move_base_node in upstream's namespaces; `apply` receives the validated ones."""
    in_use, planner = params, 'DWAPlannerROS'

    def change(part: str, values: Values) -> None:
        nonlocal in_use
        changed = with_changes(in_use, {part: values} if part else values, '')
        if changed != in_use:
            apply(changed)
            in_use = changed

    def change_layer(part: str, if_enabled: Values, otherwise: Values, values: Values) -> None:
        fields = {name: value for name, value in values.items() if name != 'enabled'}
        change(part, {**fields, **(if_enabled if values['enabled'] else otherwise)})

    ReconfigureServer(MoveBaseConfig, '', dict(params), partial(change, ''))
    ReconfigureServer(DWAPlannerConfig, planner, dict(params.DWAPlannerROS), partial(change, planner))
    for name, costmap in (('global_costmap', params.global_costmap), ('local_costmap', params.local_costmap)):
        values = {**dict(costmap), 'footprint': str(costmap.footprint), 'robot_radius': ROBOT_RADIUS_M}
        ReconfigureServer(Costmap2DConfig, name, values, partial(change, name))
        sources, none = costmap.observation_sources, {'observation_sources': ''}
        layer = f'{name}/obstacle_layer', {**values, 'enabled': bool(sources)}
        change_obstacles = partial(change_layer, name, {'observation_sources': sources or 'scan'}, none)
        ReconfigureServer(ObstaclePluginConfig, *layer, change_obstacles)
        layer = f'{name}/inflation_layer', {**values, 'enabled': True}
        ReconfigureServer(InflationPluginConfig, *layer, partial(change_layer, name, {}, {'inflation_radius': 0.0}))
