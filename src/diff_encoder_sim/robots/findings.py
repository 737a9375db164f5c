"""What was found out about a robot so far, with its sources: collected from step to step."""

from __future__ import annotations

from typing import List

from diff_encoder_sim.robots.robot_description import Found


class Findings:
    """The table, the warnings and the notes of a robot, in the order in which they were found."""

    def __init__(self) -> None:
        self.found: List[Found] = []
        self.warnings: List[str] = []
        self.notes: List[str] = []

    def add(self, quantity: str, value: object, source: str) -> None:
        """Add a row to the table."""
        self.found.append(Found(quantity, str(value), source))

    def warn(self, text: str) -> None:
        """Add what is likely wrong in the robot's file, one line."""
        if text not in self.warnings:
            self.warnings.append(text)

    def note(self, text: str) -> None:
        """Add what is done differently from the robot's file, one line."""
        if text not in self.notes:
            self.notes.append(text)
