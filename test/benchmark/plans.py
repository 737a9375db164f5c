"""Plans of trials in lockstep, with this checkout's worlds and maps."""

from __future__ import annotations

from checkout import ROOT

from diff_encoder_sim.trials.test_definition import find_world, load_test
from diff_encoder_sim.trials.trial_definition import Trial, TrialPlan


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
