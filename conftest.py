"""Makes the package importable for `pytest` in a checkout whose workspace is not sourced (core tests need no ROS)."""

import importlib.util
import sys
from pathlib import Path

# With .ws/devel/setup.bash sourced the package comes through catkin, which adds the generated messages: leave that be.
if importlib.util.find_spec('diff_encoder_sim') is None:
    sys.path.insert(0, str(Path(__file__).resolve().parent / 'src'))
