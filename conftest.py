"""Makes the package importable for `pytest` in a checkout whose workspace is not sourced (core tests need no ROS)."""

import importlib.util
import signal
import sys
from pathlib import Path

# With .ws/devel/setup.bash sourced the package comes through catkin, which adds the generated messages: leave that be.
if importlib.util.find_spec('diff_encoder_sim') is None:
    sys.path.insert(0, str(Path(__file__).resolve().parent / 'src'))

# A shell starts what runs in its background with Ctrl-C ignored, and all that tests start would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
