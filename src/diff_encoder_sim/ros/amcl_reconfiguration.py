"""Parameters of amcl_node that can be changed while it runs: those of upstream's AMCL.cfg, with its limits."""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, TypeVar

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import with_changes
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.ros.adjustable import RESTORE_DEFAULTS, Limits, adjustables_of
from diff_encoder_sim.ros.reconfiguration import serve

LIMITS: Dict[str, Limits] = {
    'min_particles': (1, 1000),
    'max_particles': (1, 10000),
    'kld_err': (0, 1),
    'kld_z': (0, 1),
    'update_min_d': (0, 5),
    'update_min_a': (0, 2 * math.pi),
    'resample_interval': (1, 20),
    'transform_tolerance': (0, 2),
    'recovery_alpha_slow': (0, 0.5),
    'recovery_alpha_fast': (0, 1),
    'do_beamskip': None,
    'beam_skip_distance': (0, 2),
    'beam_skip_threshold': (0, 1),
    'tf_broadcast': None,
    'force_update_after_initialpose': None,
    'force_update_after_set_map': None,
    'gui_publish_rate': (-1, 100),
    'save_pose_rate': (-1, 10),
    'use_map_topic': None,
    'first_map_only': None,
    'laser_min_range': (-1, 1000),
    'laser_max_range': (-1, 1000),
    'laser_max_beams': (2, 250),
    'laser_z_hit': (0, 1),
    'laser_z_short': (0, 1),
    'laser_z_max': (0, 1),
    'laser_z_rand': (0, 1),
    'laser_sigma_hit': (0, 10),
    'laser_lambda_short': (0, 10),
    'laser_likelihood_max_dist': (0, 20),
    'laser_model_type': None,
    'odom_model_type': None,
    'odom_alpha1': (0, 10),
    'odom_alpha2': (0, 10),
    'odom_alpha3': (0, 10),
    'odom_alpha4': (0, 10),
    'odom_alpha5': (0, 10),
    'odom_frame_id': None,
    'base_frame_id': None,
    'global_frame_id': None,
    RESTORE_DEFAULTS: None,
}

P = TypeVar('P', bound=AmclParams)

# What the node has subscribed to, and the frames that it has asked for.
FIXED = ('odom_frame_id', 'base_frame_id', 'global_frame_id', 'use_map_topic')


def serve_amcl(params: P, apply: Callable[[P], None]) -> List[object]:
    """Serve the parameters, and return what must be kept as long; `apply` gets them validated when they change."""

    def change(values: Dict[str, Any]) -> None:
        for name in FIXED:
            value, started_with = values[name], getattr(params, name)
            if value != started_with:
                raise ConfigError(f'{name}: given {value!r}; allowed: {started_with!r} until the node is started again')
        apply(with_changes(params, values, ''))

    return serve([('~', adjustables_of(params, LIMITS), change)])
