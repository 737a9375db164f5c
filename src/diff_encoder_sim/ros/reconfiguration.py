"""Changes of parameters while a node runs, as by rqt_reconfigure: served where dynamic_reconfigure is installed."""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Sequence, Tuple

from diff_encoder_sim.ros.adjustable import Adjustable

try:
    from diff_encoder_sim.ros.reconfigure_server import ReconfigureServer

    IS_INSTALLED = True
except ModuleNotFoundError:  # dynamic_reconfigure is a package of its own
    IS_INSTALLED = False

# A namespace, its parameters with the values in force, and what takes their new values.
Group = Tuple[str, Sequence[Adjustable], Callable[[Dict[str, Any]], None]]


def serve(groups: Sequence[Group]) -> List[object]:
    """Serve each group of parameters, and return what must be kept as long; nothing without the package.

    What takes the values raises ConfigError where it refuses them. It is called in threads of its own.
    """
    return [ReconfigureServer(*group) for group in groups] if IS_INSTALLED else []
