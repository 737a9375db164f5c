"""All tables of an analysis that are written to files."""

from __future__ import annotations

from typing import List

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_values
from diff_encoder_sim.analysis.goal_tables import GOAL_TABLES, goal_table
from diff_encoder_sim.analysis.interval_tables import interval_table
from diff_encoder_sim.analysis.path_tables import path_error_table
from diff_encoder_sim.analysis.pulse_resolution import pulse_resolution_table
from diff_encoder_sim.analysis.table import Table
from diff_encoder_sim.analysis.variant_table import variant_table


def all_tables(dataset: Dataset) -> List[Table]:
    """Build tables 3 to 6 of a dataset, the intervals of 4 to 6, and errors along the path and of variants if known."""
    tables = [pulse_resolution_table(ppr_values(dataset.encoders()), *dataset.robot)]
    for kind in GOAL_TABLES:
        tables += [goal_table(dataset, kind), interval_table(dataset, kind)]
    return [*tables, *(table for table in (path_error_table(dataset), variant_table(dataset)) if table is not None)]
