"""Which figures are written, from any dataset, the same bytes each time."""

import pytest
from PIL import Image

from diff_encoder_sim.analysis.figures import style, write_figures
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from figure_panels import requested_trial
from synthetic_trials import dataset_of, synthetic_dataset, trial_data

FOR_EACH_SOURCE = [
    f'{name}_{source.value}' for name in ('fig4_xy_errors', 'fig5_distributions') for source in PoseSource
]


def small_campaign():
    return synthetic_dataset(tests=('SL',), pprs=('40', '90'), trials=6)._replace(
        requested={'SL': requested_trial('SL')}
    )


def test_files_of_a_campaign(tmp_path):
    figures = write_figures(small_campaign(), tmp_path / 'a' / 'figures')
    assert [figure.name for figure in figures] == [*FOR_EACH_SOURCE, 'spread_vs_ppr']
    for figure in figures:
        assert figure.caption.endswith('.') and figure.png.parent == figure.svg.parent == tmp_path / 'a' / 'figures'
        assert figure.svg.read_text(encoding='utf-8').count('<text') > 10
        with Image.open(figure.png) as image:
            assert image.width == int(style.WIDTH_IN * style.PNG_DPI)


@pytest.mark.heavy
def test_the_same_dataset_gives_the_same_bytes(tmp_path):
    first, second = (write_figures(small_campaign(), tmp_path / name) for name in 'ab')
    for one, other in zip(first, second):
        assert one.png.read_bytes() == other.png.read_bytes() and one.svg.read_bytes() == other.svg.read_bytes()


@pytest.mark.heavy
@pytest.mark.filterwarnings('error::RuntimeWarning', 'error::UserWarning')
@pytest.mark.parametrize(
    ('dataset', 'count'),
    [
        (dataset_of([]), 0),
        (dataset_of([trial_data()]), 8),
        (dataset_of([trial_data(errors=dict.fromkeys(PoseSource), outcome=Outcome.ABORTED)] * 2), 9),
        (synthetic_dataset(tests=('SL',), pprs=('ideal', '90-1024'), trials=2), 8),
    ],
    ids=['none', 'one', 'no pose', 'no PPR'],
)
def test_little_data(tmp_path, dataset, count):
    assert len(write_figures(dataset, tmp_path)) == count


@pytest.mark.heavy
@pytest.mark.filterwarnings('error::RuntimeWarning', 'error::UserWarning')
def test_of_named_variants_the_first_has_figures_and_one_figure_has_all(tmp_path):
    variants = ((('variant', 'none'),), (('variant', 'missed 1 %'),))
    figures = write_figures(synthetic_dataset(tests=('SL',), pprs=('40',), trials=2, variants=variants), tmp_path)
    assert [figure.name for figure in figures] == ['variants', *FOR_EACH_SOURCE, 'spread_vs_ppr']
    assert figures[1].caption.endswith('(none).')


@pytest.mark.heavy
@pytest.mark.filterwarnings('error::RuntimeWarning', 'error::UserWarning')
def test_variants_have_figures_of_their_own_in_common_colours(tmp_path):
    variants = ((('simulator.lidar.noise', '0.01'),), (('simulator.lidar.noise', '0.03'),))
    figures = write_figures(synthetic_dataset(tests=('SL',), pprs=('40',), trials=2, variants=variants), tmp_path)
    assert [figure.name for figure in figures] == [
        f'{name}_variant{number}' for number in (1, 2) for name in (*FOR_EACH_SOURCE, 'spread_vs_ppr')
    ]
    assert all('simulator.lidar.noise 0.03' in figure.caption for figure in figures[9:])
