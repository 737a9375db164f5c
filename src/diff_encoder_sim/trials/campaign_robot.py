"""What is known of a campaign's robot, for manifest.json and the report; results depend on none of it."""

from __future__ import annotations

from typing import Any, Dict, NamedTuple, Optional, Tuple

from diff_encoder_sim.robots.robot_description import Found
from diff_encoder_sim.robots.robot_setup import RobotSetup
from diff_encoder_sim.robots.robot_source import RobotSource
from diff_encoder_sim.simulation.check_results import Check


class CampaignRobot(NamedTuple):
    """The robot, where it comes from, what was found out, and what its self-check says."""

    name: str
    file: str
    source: RobotSource
    ppr: Optional[float]  # of its own encoder; None where no robot file gives it
    found: Tuple[Found, ...]
    overrides: Dict[str, Any]  # of the robot file, by dotted keys
    warnings: Tuple[str, ...]
    notes: Tuple[str, ...]
    checks: Tuple[Check, ...] = ()  # of the self-check; none before it was run

    def as_json(self) -> Dict[str, Any]:
        """Return mappings and lists, as manifest.json has them."""
        return {
            'name': self.name,
            'file': self.file,
            'arguments': dict(self.source.arguments),
            'ppr': self.ppr,
            'found': [row._asdict() for row in self.found],
            'set': self.overrides,
            'warnings': list(self.warnings),
            'notes': list(self.notes),
            'checks': [check._asdict() for check in self.checks],
        }


def campaign_robot(setup: RobotSetup) -> CampaignRobot:
    """Return what is known of a robot before its self-check."""
    file, description = setup.file, setup.description
    return CampaignRobot(
        setup.name,
        file.where,
        file.source,
        file.ppr,
        description.found,
        file.overrides,
        description.warnings,
        description.notes,
    )
