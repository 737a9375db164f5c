"""Whether the ROS workspace is sourced, which live benchmarks need."""

from __future__ import annotations

import shutil
import subprocess

ADVICE = 'the workspace is not sourced: source .ws/devel/setup.bash'


def is_sourced() -> bool:
    """Return whether roslaunch and this package are found."""
    return bool(
        shutil.which('roslaunch')
        and shutil.which('rospack')
        and subprocess.run(
            ['rospack', 'find', 'diff_encoder_sim'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False
        ).returncode
        == 0
    )
