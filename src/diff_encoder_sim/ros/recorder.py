"""record_trial: becomes `rosbag record` for the topics and the bag of the running trial."""
from __future__ import annotations

import os
import sys
from pathlib import Path

import roslib.packages

from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.recording.topics import RECORDED
from diff_encoder_sim.ros.trial_plan import required_trial_plan


def main() -> None:
    """Entry point of the executable: replaces this process, so roslaunch's signals reach rosbag."""
    try:
        bag = Path(required_trial_plan().bag)
        recorders = roslib.packages.find_node('rosbag', 'record')
        if not recorders:
            raise ConfigError('rosbag record is not installed; allowed: apt install rosbag, or '
                              'bag:=none')
        bag.parent.mkdir(parents=True, exist_ok=True)
    except (ConfigError, OSError) as error:
        sys.exit(f'record_trial: {error}')
    remappings = [argument for argument in sys.argv[1:] if ':=' in argument]
    os.execv(recorders[0], [recorders[0], '-O', str(bag), '--lz4', *RECORDED, *remappings])
