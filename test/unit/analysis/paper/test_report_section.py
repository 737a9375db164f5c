"""The paper's section of the report, and that nothing else depends on the paper."""

import re

from diff_encoder_sim.analysis.paper.report_section import paper_section
from paper_datasets import cell, dataset
from places import SOURCE

ANALYSIS = SOURCE / 'diff_encoder_sim' / 'analysis'


def test_only_the_report_imports_the_paper():
    importers = [
        str(path.relative_to(ANALYSIS.parent))
        for path in ANALYSIS.parent.rglob('*.py')
        if path.parent != ANALYSIS / 'paper'
        and re.search(r'import.*analysis\.paper|analysis\.paper.*import', path.read_text())
    ]
    assert importers == ['analysis/report/sections.py']


def test_a_dataset_that_has_no_cell_of_the_paper_has_no_tables():
    assert paper_section(dataset(cell('own', '40', 'odom', [(0.0, 0.0, 0.0)] * 3))) is None


def test_claims_are_grouped_by_the_varied_parameters():
    rows = [(0.0, 0.0, 0.0)] * 3
    quiet, noisy = (('lidar.noise_std', '0.01'),), (('lidar.noise_std', '0.03'),)
    section = paper_section(
        dataset(cell('SL', '40', 'odom', rows, varied=quiet), cell('SL', '40', 'odom', rows, varied=noisy))
    )
    assert list(section.claims) == ['lidar.noise_std 0.01', 'lidar.noise_std 0.03']
    assert len({len(claims) for claims in section.claims.values()}) == 1
