"""The formats of bags that are recorded in lockstep."""

from __future__ import annotations

from typing import Literal

BagFormat = Literal['ros1', 'mcap']  # of ROS 1, or an MCAP file of ROS 2
