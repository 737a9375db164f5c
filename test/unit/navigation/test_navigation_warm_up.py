"""Compilation ahead of the first control period."""

import subprocess
import sys

from places import SOURCE, SUPPORT

DRIVE_AFTER_WARM_UP = """
import importlib, pkgutil
import diff_encoder_sim.navigation as navigation
from diff_encoder_sim.navigation.navigator import warm_up
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.kernels import Kernel
import navigation_simulation as simulation

def compiled():
    return {f'{module.name}.{name}': len(value.signatures)
            for module in pkgutil.iter_modules(navigation.__path__, navigation.__name__ + '.')
            for name, value in vars(importlib.import_module(module.name)).items() if isinstance(value, Kernel)}

warm_up()
before = compiled()
assert sum(before.values()) > 5, before
shapes, grid = simulation.walled_room()
loop = simulation.ClosedLoop(shapes.with_box(1.0, 0.0, 0.1, 4.0), grid, Pose2D(-1.0, 0.0, 0.0),
                             params=simulation.navigator_params(planner_patience=0.5,
                                                                NavfnROS={'use_dijkstra': False}))
for goal in Pose2D(2.0, 0.0, 0.0), Pose2D(-2.0, 0.5, 2.0):      # the first is out of reach: recoveries
    loop.navigator.set_goal(goal)
    print(loop.run(60.0).status.name)
assert compiled() == before, (before, compiled())
"""


def test_nothing_is_left_to_compile_after_the_warm_up():
    result = subprocess.run(
        [sys.executable, '-c', DRIVE_AFTER_WARM_UP],
        cwd=str(SUPPORT),
        capture_output=True,
        text=True,
        env={'PYTHONPATH': f'{SOURCE}:{SUPPORT}', 'PATH': ''},
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ['ABORTED', 'SUCCEEDED']
