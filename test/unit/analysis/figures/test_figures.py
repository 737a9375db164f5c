"""Figures: which are written, from any dataset, the same bytes each time; and what they show."""

import math

import matplotlib
import numpy as np
import pytest
from PIL import Image

from diff_encoder_sim.analysis.closed_form import closed_form_std, odometry_minus_truth
from diff_encoder_sim.analysis.dataset import Tracks
from diff_encoder_sim.analysis.figures import style, trajectory_plot, variants_of, write_figures
from diff_encoder_sim.analysis.figures.distributions import draw_distributions
from diff_encoder_sim.analysis.figures.spread import draw_spread
from diff_encoder_sim.analysis.figures.trajectory_plot import draw_trajectories
from diff_encoder_sim.analysis.figures.xy_errors import draw_xy_errors
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.test_definition import PoseParams, load_test
from diff_encoder_sim.trials.trial_definition import Trial
from diff_encoder_sim.trials.trial_outcome import Outcome
from places import CONFIG
from synthetic_trials import ALTO, dataset_of, synthetic_dataset, trial_data

FOR_EACH_SOURCE = [
    f'{name}_{source.value}' for name in ('fig4_xy_errors', 'fig5_distributions') for source in PoseSource
]


def requested_of(test, start_yaw_rad=0.0):
    definition = load_test(test, CONFIG)
    start = definition.start.model_copy(update={'yaw': start_yaw_rad})
    return Trial(test=definition.model_copy(update={'start': start}), nav='embedded')


def small_campaign():
    return synthetic_dataset(tests=('SL',), pprs=('40', '90'), trials=6)._replace(requested={'SL': requested_of('SL')})


def shown(drawing):
    """The panels that can be seen, by row."""
    return [panel for panel in drawing.axes if panel.get_visible()]


def test_files_of_a_campaign(tmp_path):
    figures = write_figures(small_campaign(), tmp_path / 'a' / 'figures')
    assert [figure.name for figure in figures] == [*FOR_EACH_SOURCE, 'spread_vs_ppr']
    for figure in figures:
        assert figure.caption.endswith('.') and figure.png.parent == figure.svg.parent == tmp_path / 'a' / 'figures'
        assert figure.svg.read_text(encoding='utf-8').count('<text') > 10
        with Image.open(figure.png) as image:
            assert image.width == int(style.WIDTH_IN * style.PNG_DPI)


def test_the_same_dataset_gives_the_same_bytes(tmp_path):
    first, second = (write_figures(small_campaign(), tmp_path / name) for name in 'ab')
    for one, other in zip(first, second):
        assert one.png.read_bytes() == other.png.read_bytes() and one.svg.read_bytes() == other.svg.read_bytes()


def test_settings_of_matplotlib_are_left_alone(tmp_path):
    before = dict(matplotlib.rcParams)
    write_figures(dataset_of([trial_data()]), tmp_path)
    assert dict(matplotlib.rcParams) == before


@pytest.mark.filterwarnings('error::RuntimeWarning', 'error::UserWarning')
@pytest.mark.parametrize(
    ('dataset', 'count'),
    [
        (dataset_of([]), 0),
        (dataset_of([trial_data()]), 8),
        (dataset_of([trial_data(errors=(1e-9, 0.0, 0.0))] * 3), 9),
        (dataset_of([trial_data(errors={PoseSource.ODOM: (0.1, 0.2, 0.3)}, number=number) for number in (1, 2)]), 9),
        (dataset_of([trial_data(errors=dict.fromkeys(PoseSource), outcome=Outcome.ABORTED)] * 2), 9),
        (dataset_of([trial_data('SL', '40'), trial_data('SMT', '90')]), 8),
        (synthetic_dataset(tests=('SL',), pprs=('ideal', '90-1024'), trials=2), 8),
    ],
    ids=['none', 'one', 'no spread', 'one source', 'no pose', 'gaps', 'no PPR'],
)
def test_little_data(tmp_path, dataset, count):
    assert len(write_figures(dataset, tmp_path)) == count


@pytest.mark.filterwarnings('error::RuntimeWarning', 'error::UserWarning')
def test_variants_have_figures_of_their_own_in_common_colours(tmp_path):
    variants = ((('simulator.lidar.noise', '0.01'),), (('simulator.lidar.noise', '0.03'),))
    figures = write_figures(synthetic_dataset(tests=('SL',), pprs=('40',), trials=2, variants=variants), tmp_path)
    assert [figure.name for figure in figures] == [
        f'{name}_variant{number}' for number in (1, 2) for name in (*FOR_EACH_SOURCE, 'spread_vs_ppr')
    ]
    assert all('simulator.lidar.noise 0.03' in figure.caption for figure in figures[9:])


def test_colours_darken_with_ppr_so_that_grey_print_can_be_read():
    luminances = [float(colour[:3] @ [0.299, 0.587, 0.114]) for colour in style.ppr_colours(list('abcdefghi')).values()]
    assert all(later < earlier - 0.03 for earlier, later in zip(luminances, luminances[1:]))
    assert luminances[0] < 0.75


def test_axes_hold_all_but_far_outliers():
    usual = np.linspace(-1.0, 1.0, 29)
    assert style.shown_limit([usual], least=0.1) == pytest.approx(1.08)
    assert 1.0 < style.shown_limit([np.append(usual, 80.0)], least=0.1) < 10.0
    assert style.shown_limit([usual, 5.0 * usual], least=0.1) == pytest.approx(5.4)
    assert style.shown_limit([np.array([])], least=0.1) == 0.1
    assert style.shown_limit([0.01 * usual], least=0.1) == pytest.approx(0.108)


def test_xy_errors_count_what_is_inside_and_what_is_beyond():
    errors = [(0.04, 0.04, 0.0), *[(0.01, 0.0, 0.0)] * 8, (7.0, 0.0, 0.0)]
    dataset = dataset_of(trial_data(number=number, errors=error) for number, error in enumerate(errors))
    (panel,) = shown(draw_xy_errors(variants_of(dataset)[0], PoseSource.ODOM))
    assert panel.get_title() == '90 PPR\n8 of 10 inside, 1 beyond'
    assert panel.get_ylabel().startswith('SL')


def test_a_row_of_xy_errors_has_one_scale():
    panels = shown(draw_xy_errors(variants_of(synthetic_dataset(trials=10))[0], PoseSource.ODOM))
    limits = [panel.get_xlim() for panel in panels]
    assert len(panels) == 12
    assert all(len(set(limits[row : row + 4])) == 1 for row in (0, 4, 8)) and len(set(limits)) > 1


def test_many_encoders_wrap():
    dataset = synthetic_dataset(tests=('SL', 'SMT'), pprs=tuple(str(number) for number in range(10, 26)), trials=1)
    drawing = draw_xy_errors(variants_of(dataset)[0], PoseSource.ODOM)
    assert len(shown(drawing)) == 32 and len(drawing.axes) == 32
    assert len(shown(draw_distributions(variants_of(dataset)[0], PoseSource.ODOM))) == 6


def test_odometry_minus_truth_goes_round_at_half_a_turn():
    trials = [
        trial_data(errors={PoseSource.ODOM: (0.3, 0.0, 3.1), PoseSource.WORLD: (0.1, 0.0, -3.1)}),
        trial_data(errors={PoseSource.ODOM: (0.3, 0.0, 3.1), PoseSource.WORLD: None}),
    ]
    assert odometry_minus_truth(trials, X) == pytest.approx([0.2])
    assert odometry_minus_truth(trials, YAW) == pytest.approx([math.degrees(6.2 - 2.0 * math.pi)])


@pytest.mark.parametrize(('ppr', 'lateral_m'), [(40, 0.321), (90, 0.142), (1024, 0.0125), (4096, 0.0031)])
def test_closed_form_of_the_straight_line(ppr, lateral_m):
    m_per_pulse = math.pi * 0.2 / ppr
    x_m, y_m, yaw_rad = closed_form_std(requested_of('SL'), ALTO, ppr)
    assert y_m == pytest.approx(lateral_m, rel=0.015)
    assert yaw_rad == pytest.approx(m_per_pulse / 0.4 * math.sqrt(1.0 / 3.0))


def test_closed_form_is_along_the_maps_axes():
    requested = requested_of('SL')
    turned = requested.model_copy(
        update={
            'test': requested.test.model_copy(
                update={
                    'start': PoseParams(yaw=math.pi / 2),
                    'route': [
                        requested.test.route[-1].model_copy(update={'goal': PoseParams(y=20.0, yaw=math.pi / 2)})
                    ],
                }
            )
        }
    )
    along_x, along_y = closed_form_std(requested, ALTO, 40), closed_form_std(turned, ALTO, 40)
    assert along_y == pytest.approx(along_x[[1, 0, 2]])


def test_spread_has_a_line_for_each_source_and_the_closed_form():
    dataset = synthetic_dataset(tests=('SL',), trials=5)
    panels = shown(draw_spread(variants_of(dataset)[0], ALTO, {'SL': requested_of('SL')}))
    labels = panels[1].get_legend_handles_labels()[1]
    assert len(panels) == 3 and len(labels) == 6
    closed_form = next(line for line in panels[1].lines if line.get_label().startswith('quantisation alone'))
    assert closed_form.get_ydata() == pytest.approx([0.321, 0.142, 0.0125, 0.0031], rel=0.02)


def driven():
    """A dataset with two encoders, whose odometry starts right and leaves by a metre in twenty."""
    x_m = np.linspace(-10.0, 10.0, 50)
    tracks = Tracks(*(np.column_stack((x_m, slope * (x_m + 10.0))) for slope in (0.0, 0.05)))
    return dataset_of(
        (
            trial_data('SL', ppr, number, tracks=tracks, outcome=Outcome.SUCCEEDED if number else Outcome.COLLISION)
            for ppr in ('40', '90')
            for number in range(12)
        ),
        requested={'SL': requested_of('SL')},
    )


def test_trajectories_are_over_the_map_and_few():
    panels = shown(draw_trajectories(variants_of(driven())[0], 'SL', requested_of('SL')))
    assert [panel.get_title() for panel in panels] == ['SL, 40 PPR', 'SL, 90 PPR']
    true, odometry = (each.get_segments() for each in panels[0].collections)
    assert len(true) == len(odometry) == trajectory_plot.MOST_TRIALS
    assert odometry[0][0] == pytest.approx([-10.0, 0.0]) and odometry[0][-1] == pytest.approx([10.0, 1.0])
    assert len(panels[0].images) == 1
    assert len(panels[0].lines) == 3  # start, goal, and the end of the trial that failed


def test_trajectories_need_tracks(tmp_path):
    dataset = driven()
    assert 'trajectories_SL' in [figure.name for figure in write_figures(dataset, tmp_path / 'with')]
    without = dataset._replace(trials=[trial._replace(tracks=None) for trial in dataset.trials])
    assert 'trajectories_SL' not in [figure.name for figure in write_figures(without, tmp_path / 'without')]


def test_a_world_that_is_not_here_has_no_map():
    requested = requested_of('SL')
    elsewhere = requested.model_copy(
        update={'test': requested.test.model_copy(update={'world': '/nowhere/else.world'})}
    )
    assert len(shown(draw_trajectories(variants_of(driven())[0], 'SL', elsewhere))[0].images) == 0
