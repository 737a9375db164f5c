"""The paper's tests: what the robot is to do, and what a trial is."""
