"""Directive `calculator`: advice on two numbers, computed by _static/calculator.js with the package's constants."""

from __future__ import annotations

import json
import math
from statistics import NormalDist
from typing import Any, Dict, List, Tuple

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from diff_encoder_sim.advice.answers import Requirement
from diff_encoder_sim.advice.drive_draws import IDEAL_SAMPLES, MOST_IDEAL_SAMPLES, SAMPLES_PER_TURN, STOP_OF_RECORDED
from diff_encoder_sim.advice.odometry_answer import FEWEST_COUNTS, FINE_POINTS, MOST_COUNTS
from diff_encoder_sim.analysis.closed_form import LEAST_PULSES
from diff_encoder_sim.api.options import AdviceOptions
from diff_encoder_sim.api.recorded_advice import DISTANCE_M
from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.drives.test_definition import SpeedLimits
from diff_encoder_sim.robots.wheel_quality import CALIBRATED, QUALITIES
from diff_encoder_sim.trials.scripted_drive import PAUSE_BETWEEN_SEGMENTS_S

# Option of advise, label, default, and least, most and step of the slider; that of the counts is in octaves.
SLIDERS = (
    ('wheel-diameter', 'Wheel diameter [m]', 0.2, (0.03, 0.6, 0.005)),
    ('wheel-separation', 'Wheel separation [m]', 0.45, (0.05, 1.5, 0.01)),
    ('distance', 'Straight drive [m]', DISTANCE_M, (1, 100, 1)),
    ('turns', 'Turns in place', AdviceOptions.turns, (0, 20, 1)),
    ('ppr', 'Counts per wheel turn', 1024.0, (math.log2(FEWEST_COUNTS), math.log2(MOST_COUNTS), 0.0625)),
)
SLIDER = """<label>{label}
<input type="number" name="{key}" min="{least:g}" max="{most:g}" step="any" value="{default:g}" required>
<input type="range" data-of="{key}" aria-label="{label}" min="{low:g}" max="{high:g}" step="{step:g}"></label>"""
PAGE = """<link rel="stylesheet" href="_static/calculator.css">
<div id="calculator-box" aria-busy="true">
<form>{controls}</form>
<p class="answer" id="answer" aria-live="polite">The calculator needs JavaScript.</p>
<p id="chosen"></p>
<figure id="curve"></figure>
<div class="table-wrapper"><table class="docutils" id="errors"></table></div>
<p id="closed-form"></p>
<p>The same with <code>advise</code>, which takes more samples and lists the encoders that suffice:</p>
<pre id="command"></pre>
<script type="application/json" id="calculator-facts">{facts}</script>
<script src="_static/calculator.js"></script>
</div>"""


class CalculatorDirective(SphinxDirective):
    """The form, the places of the results, and the constants."""

    def run(self) -> List[nodes.Node]:
        """Return raw HTML."""
        qualities = ''.join(
            f'<option value="{each.name}"{" selected" * (each == CALIBRATED)}>{each.text}</option>'
            for each in QUALITIES.values()
        )
        wheels = f'<label>Accuracy of the wheels<select name="wheels" required>{qualities}</select></label>'
        page = PAGE.format(controls='\n'.join([*map(_slider, SLIDERS), wheels]), facts=json.dumps(_facts()))
        return [nodes.raw('', page, format='html')]


def _slider(slider: Tuple[str, str, float, Tuple[float, float, float]]) -> str:
    key, label, default, (low, high, step) = slider
    bounds = Between(FEWEST_COUNTS, MOST_COUNTS)  # of the curve
    if key != 'ppr':
        bounds = AdviceOptions.__dataclass_fields__[key.replace('-', '_')].metadata['bounds']
    values = {'low': low, 'high': high, 'step': step, 'least': bounds.least, 'most': bounds.most}
    return SLIDER.format(key=key, label=label, default=default, **values)


def _facts() -> Dict[str, Any]:
    """Return the constants of the package that the calculator uses."""
    requirement, normal = Requirement(), NormalDist()
    return {
        'share': requirement.share,
        'tolerances': requirement.tolerances.tolist(),
        'z': normal.inv_cdf(0.5 + 0.5 * requirement.confidence),
        'normalReach': normal.inv_cdf(0.5 + 0.5 * requirement.share),
        'ends': list(STOP_OF_RECORDED),
        'reports': [IDEAL_SAMPLES, SAMPLES_PER_TURN, MOST_IDEAL_SAMPLES],
        'limits': SpeedLimits().model_dump(),
        'pause': PAUSE_BETWEEN_SEGMENTS_S,
        'leastPulses': LEAST_PULSES,
        'counts': [FEWEST_COUNTS, MOST_COUNTS],
        'finePoints': FINE_POINTS,
        'wheels': {each.name: {'text': each.text, 'std': each.std} for each in QUALITIES.values()},
    }


def setup(app: Sphinx) -> Dict[str, bool]:
    """Register the directive with Sphinx."""
    app.add_directive('calculator', CalculatorDirective)
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
