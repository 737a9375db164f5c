"""A scripted drive in lockstep, as scripted_drive_node drives it live."""

from __future__ import annotations

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.navigation.goal_status import Command
from diff_encoder_sim.trials.driver import SendCommand
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive


class ScriptedDriver:
    """Drives by time alone."""

    def __init__(self, trial: Trial, send: SendCommand) -> None:
        self._drive, self._send = ScriptedDrive(trial.test), send
        self.is_over = False

    def take_time(self, now_ns: int) -> None:
        """Send the command for the period that begins."""
        elapsed_s = now_ns / NANOSECONDS_PER_SECOND
        self._send(now_ns, Command(*self._drive.command_at(elapsed_s)), False)
        self.is_over = self._drive.is_over(elapsed_s)

    def take_scan(self, scan: Scan) -> None:
        """Ignore it."""
