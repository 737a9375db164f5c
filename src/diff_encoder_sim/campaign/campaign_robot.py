"""What is known of a campaign's robot, for manifest.json and the report; results depend on none of it."""

from __future__ import annotations

from typing import Any, Dict, NamedTuple, Tuple

from diff_encoder_sim.robots.robot_description import Found
from diff_encoder_sim.robots.robot_setup import RobotSetup


class CampaignRobot(NamedTuple):
    """The robot, where it comes from, what was found out, and what its self-check says."""

    name: str
    file: str
    arguments: Tuple[Tuple[str, str], ...]  # of its xacro
    found: Tuple[Found, ...]
    overrides: Dict[str, Any]  # of the robot file, by dotted keys
    warnings: Tuple[str, ...]
    notes: Tuple[str, ...]
    checks: Tuple[Dict[str, Any], ...] = ()  # rows of the self-check; none before it was run

    def as_json(self) -> Dict[str, Any]:
        """Return mappings and lists, as manifest.json has them."""
        return {
            'name': self.name,
            'file': self.file,
            'arguments': dict(self.arguments),
            'found': [row._asdict() for row in self.found],
            'set': self.overrides,
            'warnings': list(self.warnings),
            'notes': list(self.notes),
            'checks': list(self.checks),
        }


def campaign_robot(setup: RobotSetup) -> CampaignRobot:
    """Return what is known of a robot before its self-check."""
    file, description = setup.file, setup.description
    return CampaignRobot(
        setup.name,
        file.where,
        file.source.arguments,
        description.found,
        file.overrides,
        description.warnings,
        description.notes,
    )
