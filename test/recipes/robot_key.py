from pathlib import Path

from diff_encoder_sim.trials.robot_params import load_robot, load_robot_config, override

setup = load_robot('slow.yaml', Path(), Path(), {})
assert override(load_robot_config(Path('config')), setup.settings).simulator.drive.max_linear_speed == 0.1
