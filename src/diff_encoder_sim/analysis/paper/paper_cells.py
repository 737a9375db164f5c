"""Tables 3 to 6, errata and claims of the paper, from config/paper, and the trials that they refer to."""

from __future__ import annotations

from typing import Any, Dict, List, Optional

import numpy as np

from diff_encoder_sim.analysis.results_table import Results, RobotGeometry
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Trial

TRIALS = 30  # per cell
PPRS = ('40', '90', '1024', '4096')
STATISTICS = ('min', 'max', 'std', 'pct_within')

# Table 3 as printed, by PPR: travel per pulse (that at 90 PPR is an erratum), and rotation per pulse of both wheels in
# opposite directions.
PRINTED_RESOLUTIONS: Dict[str, Dict[float, float]] = {
    'linear_mm': {40: 15.7, 90: 7.98, 1024: 0.61, 4096: 0.15},
    'two_wheel_angle_deg': {40: 4.5, 90: 2.0, 1024: 0.18, 4096: 0.045},
}

# Cells used for calibration: table, test, PPR and quantity (docs/adr/0012-calibration.md).
CALIBRATED = {'table': '4', 'test': 'SL', 'ppr': '4096', 'quantity': 'y_m'}

# ALTO (section 3 of the paper): wheels, and length and width [m].
WHEELS = RobotGeometry(0.2, 0.4)
OUTLINE_M = (0.5, 0.6)
RELATIVE = 0.01  # tolerance for calibrated wheels


def load_paper_cells() -> pd.DataFrame:
    """Load the numbers of tables 4 to 6, in the file's order.

    Returns:
        `table`, `source` (of quantities.POSES), `test`, `ppr` (encoder label), `quantity`, `statistic` (of STATISTICS),
        `paper`: the number in m, deg or per cent; `left_out`: reasons to exclude it: keys of errata, and `calibrated`
        if it was used for calibration.
    """
    cells = _read('tables_4_5_6.csv').rename(columns={'value': 'paper'}).assign(left_out='')
    # An erratum without statistics or quantities affects all of them.
    columns = {'table': 'tables', 'test': 'test', 'ppr': 'ppr', 'statistic': 'statistics', 'quantity': 'quantities'}
    rules = [{'key': one['key'], **{name: one[of] for name, of in columns.items()}} for one in load_errata()]
    for rule in [*(rule for rule in rules if rule['table']), {'key': 'calibrated', **CALIBRATED}]:
        names = [name for name in columns if rule.get(name)]
        is_affected = np.all([cells[name].isin(rule[name].split()) for name in names], axis=0)
        cells.loc[is_affected, 'left_out'] += f' {rule["key"]}'
    cells['left_out'] = cells['left_out'].str.strip()
    return cells.assign(source=cells['source'].str.replace('_pose', '')).astype({'table': int, 'paper': float})


def load_errata() -> List[Dict[str, str]]:
    """Load the errata of the paper: `key`, `where`, `printed`, `right`, `why`, and the affected cells."""
    errata: List[Dict[str, str]] = _read('errata.csv').to_dict('records')
    return errata


def load_claims() -> List[Dict[str, str]]:
    """Load the paraphrased claims of the paper: `key`, `text`, and `where` in the paper."""
    claims: List[Dict[str, str]] = _read('claims.csv').to_dict('records')
    return claims


def _read(name: str) -> pd.DataFrame:
    return pd.read_csv(package_folder() / 'config' / 'paper' / name, dtype=str, keep_default_na=False)


def of_paper(results: Results) -> Results:
    """Return only the trials with the robot and the tests of the paper.

    The robot is compared by its wheels, and by its outline if known; a test by its definition, navigated only.
    """
    robots = [(results.robot, WHEELS), (_outline_m(results.manifest), OUTLINE_M)]
    is_alto = all(given is None or np.allclose(given, expected, RELATIVE, 0.0) for given, expected in robots)
    tests = {test for test, requested in results.requested.items() if is_alto and _is_of_paper(requested)}
    return results._replace(trials=results.trials[results.trials['test'].isin(tests)])


def _is_of_paper(requested: Trial) -> bool:
    try:
        own = load_test(requested.test.name, package_folder() / 'config')
    except ConfigError:  # a test that the package does not have
        return False
    return requested.nav != 'scripted' and requested.test == own


def _outline_m(manifest: Dict[str, Any]) -> Optional[np.ndarray]:
    """Return length and width of the footprint of a campaign's robot; None if unknown."""
    try:
        corners = manifest['configuration']['parameters'][0]['navigator']['local_costmap']['footprint']
        size_m: np.ndarray = np.ptp(np.asarray(corners, float), axis=0)
    except (KeyError, IndexError, TypeError, ValueError):
        return None
    return size_m
