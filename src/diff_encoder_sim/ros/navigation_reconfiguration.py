"""Parameters of move_base_node that can be changed while it runs, in upstream's namespaces."""

from __future__ import annotations

import threading
from typing import Any, Callable, Dict, Iterator, Mapping

from diff_encoder_sim.base.typed_params import with_changes
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.ros.adjustable import adjustable, adjustables_of
from diff_encoder_sim.ros.navigation_limits import COSTMAP, DWA, INFLATION_LAYER, MOVE_BASE, OBSTACLE_LAYER
from diff_encoder_sim.ros.reconfiguration import Group, serve

COSTMAPS = ('global_costmap', 'local_costmap')

# Upstream's default; it counts where the footprint is emptied.
ROBOT_RADIUS_M = 0.46
RADIUS_LIMITS = (0, 10)


class NavigationReconfiguration:
    """Serves the parameters of the navigator and its parts.

    Args:
        params: in force.
        apply: gets all parameters, validated, when one has changed.
    """

    def __init__(self, params: NavigatorParams, apply: Callable[[NavigatorParams], None]) -> None:
        self._params, self._apply = params, apply
        self._lock = threading.Lock()  # each namespace is served in a thread of its own
        self._servers = serve(list(self._groups()))

    def _groups(self) -> Iterator[Group]:
        params = self._params
        yield '~', adjustables_of(params, MOVE_BASE), self._change
        yield '~DWAPlannerROS', adjustables_of(params.DWAPlannerROS, DWA), self._changer('DWAPlannerROS', dict)
        for name in COSTMAPS:
            yield from self._costmap_groups(name, getattr(params, name))

    def _costmap_groups(self, name: str, costmap: CostmapParams) -> Iterator[Group]:
        footprint = type(costmap).model_fields['footprint'].description or ''
        shape = [
            adjustable('footprint', str(costmap.footprint), None, footprint),
            adjustable('robot_radius', ROBOT_RADIUS_M, RADIUS_LIMITS, 'of a round robot, where footprint is [] [m]'),
        ]
        yield f'~{name}', [*adjustables_of(costmap, COSTMAP), *shape], self._changer(name, dict)
        sources = costmap.observation_sources
        obstacles = adjustable('enabled', bool(sources), None, 'scans are entered; false: their obstacles are gone')
        yield (
            f'~{name}/obstacle_layer',
            [obstacles, *adjustables_of(costmap, OBSTACLE_LAYER)],
            self._changer(name, lambda values: _obstacle_layer(values, sources or 'scan')),
        )
        inflation = adjustable('enabled', True, None, 'cells near obstacles cost; false: as with inflation_radius 0')
        yield (
            f'~{name}/inflation_layer',
            [inflation, *adjustables_of(costmap, INFLATION_LAYER)],
            self._changer(name, _inflation_layer),
        )

    def _changer(
        self, part: str, fields_of: Callable[[Dict[str, Any]], Mapping[str, Any]]
    ) -> Callable[[Dict[str, Any]], None]:
        """Return what takes the values of a namespace, and makes them fields of a part of the parameters."""
        return lambda values: self._change({part: fields_of(values)})

    def _change(self, changes: Mapping[str, Any]) -> None:
        with self._lock:
            params = with_changes(self._params, changes, '')
            if params != self._params:
                self._apply(params)
                self._params = params


def _obstacle_layer(values: Dict[str, Any], sources: str) -> Dict[str, Any]:
    fields = {name: value for name, value in values.items() if name != 'enabled'}
    return {**fields, 'observation_sources': sources if values['enabled'] else ''}


def _inflation_layer(values: Dict[str, Any]) -> Dict[str, Any]:
    fields = {name: value for name, value in values.items() if name != 'enabled'}
    return fields if values['enabled'] else {**fields, 'inflation_radius': 0.0}
