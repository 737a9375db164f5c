"""record_trial: becomes `rosbag record` for the topics and the bag of the running trial."""
from __future__ import annotations

from pathlib import Path

from diff_encoder_sim.cli.run import run_tool
from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.recording.topics import RECORDED
from diff_encoder_sim.ros.processes import become
from diff_encoder_sim.ros.trial_plan import required_trial_plan


def main() -> None:
    """Entry point of the executable."""
    run_tool('record_trial', _record)


def _record() -> None:
    bag = Path(required_trial_plan().bag)
    try:
        bag.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f'bag: {bag.parent} cannot be made: {error.strerror}') from None
    become('rosbag', 'record', ['-O', str(bag), '--lz4', *RECORDED],
           'apt install rosbag (ros-noetic-rosbag), or bag:=none')
