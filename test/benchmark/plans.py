"""Plans of trials in lockstep, with this checkout's worlds and maps."""

from __future__ import annotations

from typing import Any, Dict

from checkout import ROOT

from diff_encoder_sim.drives.test_definition import find_world, load_test
from diff_encoder_sim.drives.trial_definition import Trial, TrialPlan
from diff_encoder_sim.trials.campaign_loading import load_campaign


def plan_of(test: str, ppr: float, number: int, nav: str = 'embedded', bag: str = '') -> TrialPlan:
    """One trial of a test by its name; an empty `bag` is none."""
    definition = load_test(test, ROOT / 'config')
    world = find_world(definition.world, ROOT / 'worlds')
    return TrialPlan(
        trial=Trial(test=definition, ppr={'left': ppr, 'right': ppr}, number=number, nav=nav),
        world=str(world),
        map=str(world.with_suffix('.yaml')),
        bag=bag,
    )


def paper_settings_with_ideal_wheels() -> Dict[str, Any]:
    """The parameters that config/campaigns/paper.yaml sets, but for wheel errors."""
    settings = load_campaign('paper', ROOT).params.overrides
    return {key: value for key, value in settings.items() if not key.startswith('simulator.wheel_errors.')}
