"""The report: the answer's words against counts made by hand, and what the page is made of."""

import html
import html.parser
import re

import pytest

from diff_encoder_sim.analysis.figures.style import Figure
from diff_encoder_sim.analysis.ppr_comparison import compare_pprs
from diff_encoder_sim.analysis.report import write_report
from diff_encoder_sim.analysis.report.closed_form_table import closed_form_table
from diff_encoder_sim.analysis.report.encoders import compare_encoders
from diff_encoder_sim.analysis.report.headline import headline
from diff_encoder_sim.analysis.report.pictures import data_uri
from diff_encoder_sim.analysis.report.provenance import provenance
from diff_encoder_sim.analysis.report.summary import summary_rows
from diff_encoder_sim.analysis.report.trials import bag_links
from diff_encoder_sim.analysis.tables import all_tables
from diff_encoder_sim.analysis.within_tolerance import Sufficiency, fewest_trials, fraction_within
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_definition import Trial
from diff_encoder_sim.trials.trial_outcome import Outcome
from paper_datasets import cell, dataset, trial

IN, OUT, TURNED = (0.01, -0.02, 1.0), (0.01, 0.3, 1.0), (0.01, -0.02, 4.0)
SL = {
    'name': 'SL',
    'world': 'hallway',
    'start': {'x': 0.0, 'y': 0.0, 'yaw': 0.0},
    'route': [{'goal': {'x': 20.0, 'y': 0.0, 'yaw': 0.0}}],
}
GOAL = 'within 0.05 m in x and y and 3 degrees of the goal'
ENOUGH = f'Encoders with which at least 80 % of trials end {GOAL} (95 % confidence):'

# HTML elements that have no end.
VOID = {'meta', 'link', 'img'}


def rows(inside, outside):
    """So many final errors within the tolerance, and so many beyond."""
    return [IN] * inside + [OUT] * outside


def both(test, ppr, world, odom, **others):
    """A cell whose sources are (inside, outside)."""
    return [
        trial(test, ppr, number, world=true, odom=estimated, **others)
        for number, (true, estimated) in enumerate(zip(rows(*world), rows(*odom)), start=1)
    ]


# ---- the answer


def test_a_fraction_is_of_the_trials_with_a_pose_and_joint_over_position_and_heading():
    trials = cell('SL', '90', 'odom', [IN, IN, OUT, TURNED, None])
    trials.append(trial('SL', '90', 6, outcome=Outcome.TORN, odom=IN))
    fraction = fraction_within(trials, PoseSource.ODOM)
    assert fraction[:4] == (4, 2, 3, 3)
    assert fraction_within(trials, PoseSource.WORLD) is None


@pytest.mark.parametrize(
    ('inside', 'sufficiency'),
    [
        (30, Sufficiency.YES),
        (29, Sufficiency.YES),
        (28, Sufficiency.UNDECIDED),
        (20, Sufficiency.UNDECIDED),
        (19, Sufficiency.NO),
        (0, Sufficiency.NO),
    ],
)
def test_a_fraction_is_sufficient_where_wilsons_interval_says_so(inside, sufficiency):
    # 28 of 30: 0.787 to 0.982; 29: 0.833 to 0.994; 20: 0.488 to 0.808; 19: 0.455 to 0.781.
    fraction = fraction_within(cell('SL', '90', 'odom', rows(inside, 30 - inside)), PoseSource.ODOM)
    assert fraction.sufficiency is sufficiency


def test_sixteen_trials_can_show_the_fraction_and_fifteen_cannot():
    assert fewest_trials() == 16  # n / (n + 1.96^2) >= 0.8 from n = 15.4 on


def test_the_summary_has_a_row_for_each_test_and_source():
    rows_of = summary_rows(dataset(cell('SL', '40', 'odom', [IN]), cell('SMT', '90', 'odom', [IN])))
    assert [(row.test, row.source, list(row.fractions)) for row in rows_of] == [
        (test, source, [ppr])
        for test, ppr in (('SL', '40'), ('SMT', '90'))
        for source in (PoseSource.WORLD, PoseSource.GLOBAL, PoseSource.ODOM)
    ]


def test_encoders_are_in_the_order_of_their_pulses_also_where_the_first_test_has_not_all():
    rows_of = summary_rows(
        dataset(cell('SL', '90', 'odom', [IN]), cell('SMT', '40', 'odom', [IN]), cell('SMT', '90', 'odom', [IN]))
    )
    assert [list(row.fractions) for row in rows_of if row.source == PoseSource.ODOM] == [['90'], ['40', '90']]


# ---- the main line


def test_the_headline_names_encoders_by_test_and_source():
    assert headline(
        dataset(
            both('SL', '40', (30, 0), (0, 30)),
            both('SL', '90', (30, 0), (25, 5)),
            both('SL', '1024', (30, 0), (30, 0)),
            both('SL', '4096', (30, 0), (30, 0)),
            both('SMT', '40', (30, 0), (30, 0)),
            both('SMT', '90', (0, 30), (30, 0)),
            both('SMT', '1024', (30, 0), (30, 0)),
            both('SMT', '4096', (0, 30), (30, 0)),
            both('DLD', '40', (30, 0), (0, 30)),
            both('DLD', '90', (30, 0), (0, 30)),
        )
    ) == (
        ENOUGH,
        {
            'true pose': 'SL and DLD: every encoder; SMT: 40 and 1024 PPR',
            'odometry alone': 'SL: from 1024 PPR (90 PPR undecided); SMT: every encoder; DLD: no encoder',
        },
        '',
    )


def test_failures_are_counted():
    trials = both('SL', '40', (30, 0), (30, 0))
    trials[7] = trials[7]._replace(outcome=Outcome.COLLISION)
    assert headline(dataset(trials)) == (
        ENOUGH,
        {'true pose': 'SL: 40 PPR', 'odometry alone': 'SL: 40 PPR'},
        '1 of 30 trials did not succeed.',
    )


def test_few_trials_are_counted_and_called_few():
    assert headline(dataset(both('SL', '40', (5, 0), (1, 4)), both('SL', '90', (4, 1), (5, 0)))) == (
        f'5 trials per cell cannot show that 80 % end within tolerance; that takes 16. Trials so far that end {GOAL}:',
        {'true pose': 'SL: 9 of 10', 'odometry alone': 'SL: 6 of 10'},
        '',
    )


def test_the_pose_estimate_is_listed_where_there_is_one():
    assert headline(dataset(cell('SL', '40', 'global', rows(30, 0)))).by_source == {'pose estimate': 'SL: 40 PPR'}


def test_one_trial_and_none_with_a_pose():
    one = headline(dataset(cell('SL', '40', 'world', [IN])))
    assert one.statement.startswith('1 trial per cell') and one.by_source == {'true pose': 'SL: 1 of 1'}
    assert headline(dataset([trial('SL', '40', 1, outcome=Outcome.LOST)])).text == (
        'No trial ended with a pose: nothing can be concluded.'
    )


def test_many_sets_of_parameters_are_counted_and_few_are_named():
    def by_source(values):
        return headline(
            dataset(
                *(both('SL', '40', (30, 0), (0, 30), varied=(('simulator.lidar.noise', value),)) for value in values)
            )
        ).by_source

    assert by_source(['0.01', '0.03'])['true pose'] == 'SL (noise 0.01) and SL (noise 0.03): 40 PPR'
    assert by_source('1234567') == {'true pose': 'in 7 of 7 cells', 'odometry alone': 'in 0 of 7 cells'}


def test_encoders_without_one_ppr_are_named_too():
    by_source = headline(
        dataset(
            both('SL', '40', (30, 0), (0, 30)),
            both('SL', '90L1024R', (30, 0), (30, 0)),
            both('SL', 'ideal', (30, 0), (30, 0)),
        )
    ).by_source
    assert by_source['odometry alone'] == 'SL: 90L1024R PPR and ideal odometry'


def test_the_text_is_a_line_for_each_source():
    trials = both('SL', '40', (30, 0), (0, 30))
    trials[7] = trials[7]._replace(outcome=Outcome.COLLISION)
    assert headline(dataset(trials)).text.splitlines() == [
        ENOUGH,
        '  true pose:      SL: 40 PPR',
        '  odometry alone: SL: no encoder',
        '1 of 30 trials did not succeed.',
    ]


# ---- sections


def test_encoders_that_differ_are_named_worse_first():
    wide = [(0.0, 0.1 * (-1) ** number * (1 + number % 5), 0.0) for number in range(30)]
    narrow = [(x, 0.01 * y, yaw) for x, y, yaw in wide]
    comparison = compare_encoders(
        compare_pprs(
            dataset(cell('SL', '40', 'odom', wide), cell('SL', '90', 'odom', wide), cell('SL', '1024', 'odom', narrow))
        )
    )
    assert comparison.table.rows == [['SL', '/odom, y', *['40 than 1024; 90 than 1024'] * 3]]
    assert [sentence[:40] for sentence in comparison.conclusions['SL']][:1] == [
        '/odom, y: 40 PPR spreads more than 1024 '
    ]
    assert comparison.comparisons == 3 * 3 * 3  # pairs, axes, questions of the one source


def test_equal_encoders_do_not_differ():
    comparison = compare_encoders(
        compare_pprs(dataset(cell('SL', '40', 'odom', [IN, OUT, TURNED]), cell('SL', '90', 'odom', [IN, OUT, TURNED])))
    )
    assert comparison.table is None and not comparison.conclusions and comparison.comparisons == 9


def manifest():
    return {
        'fingerprint': 'f00d',
        'seeds': {'first': 1, 'last': 30},
        'runs': [
            {
                'started': '2026-01-02T03:04:05+00:00',
                'command': ['/ws/scripts/campaign', '--config', 'my file.yaml', '--out', 'results'],
                'versions': {'numpy': '2.0', 'dask': None},
                'commit': {'id': 'abc', 'is_dirty': True},
                'machine': {'cpu': 'a chip', 'cores': 4, 'usable_cores': 2, 'memory_bytes': 8 * 2**30, 'os': 'Linux'},
            }
        ],
        'configuration': {'nav': 'embedded', 'tests': [SL]},
    }


def test_the_closed_form_is_that_of_a_straight_drive():
    made = dataset(cell('SL', '40', 'odom', [(0.0, 0.3, 1.0), (0.0, -0.3, -1.0)]))
    made = made._replace(
        trials=[one._replace(errors={**one.errors, PoseSource.WORLD: Pose2D(0.0, 0.0, 0.0)}) for one in made.trials],
        requested={'SL': Trial.from_mapping({'test': SL, 'nav': 'embedded'}, '')},
    )
    cells = {row[1]: row[2:] for row in closed_form_table(made).rows}
    # (S d / L) sqrt(1/6) = 321 mm and (d / L) sqrt(1/3) = 1.30 degrees; 0.3 m sqrt(2) = 424 mm.
    assert cells['y [mm]'][0] == '321' and cells['y [mm]'][1].startswith('424 (')
    assert cells['yaw [deg]'][0] == '1.3' and cells['yaw [deg]'][2] == 'as expected'
    assert cells['x [mm]'][2] == 'below'
    assert closed_form_table(dataset(cell('SL', '40', 'odom', [IN]))) is None


def test_the_origin_names_the_commands_and_the_host(tmp_path):
    origin = provenance(dataset([])._replace(manifest=manifest(), folder=tmp_path / 'results'))
    assert origin.commands == [
        "rosrun diff_encoder_sim campaign --config 'my file.yaml' --out results",
        f'rosrun diff_encoder_sim analyze {tmp_path}/results',
    ]
    run = dict(origin.runs[0].facts)
    assert run['commit'] == 'abc with changes' and run['versions'] == 'numpy 2.0'
    assert run['host'] == 'a chip, 2 of 4 cores, 8 GiB, Linux'
    assert 'world: hallway' in origin.configuration


def test_bags_alone_have_no_origin_but_the_libraries():
    origin = provenance(dataset([]))
    assert (origin.commands, origin.runs, origin.configuration) == ([], [], None)
    assert origin.facts[0].text.startswith('python ')


# ---- the page


class Elements(html.parser.HTMLParser):
    """Collects starts of elements; asserts that each is ended in order."""

    def __init__(self, text):
        super().__init__()
        self.starts, self._open = [], []
        self.feed(text)
        assert not self._open

    def handle_starttag(self, tag, attrs):
        self.starts.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag, (tag, self.getpos())

    def of(self, tag):
        return [attributes for name, attributes in self.starts if name == tag]


@pytest.fixture
def figure(tmp_path):
    svg, png = tmp_path / 'a.svg', tmp_path / 'a.png'
    svg.write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>')
    png.write_bytes(b'\x89PNG' + bytes(200))
    return Figure('a', 'A caption <of> it.', png, svg)


def page_of(made, folder, figures=()):
    path = folder / 'report.html'
    lead = write_report(made, all_tables(made), compare_pprs(made), figures, path)
    page = path.read_text(encoding='utf-8')
    for text in (lead.statement, *lead.by_source, *lead.by_source.values(), lead.failures):
        assert text in html.unescape(page)
    return page


def test_the_page_is_one_file_with_heads_captions_and_texts_for_pictures(tmp_path, figure):
    made = dataset(
        *(both(test, ppr, (20, 10), (15, 15)) for test in ('SL', 'SMT') for ppr in ('40', '90', '1024', '4096'))
    )
    page = page_of(made, tmp_path, [figure])
    elements = Elements(page)
    assert not elements.of('link')[1:] and elements.of('link')[0]['href'] == 'data:,'
    assert all('src' not in script for script in elements.of('script'))
    assert not re.search(r'@import|url\(', page)
    [image] = elements.of('img')
    assert image['src'].startswith('data:') and image['alt'] == 'A caption <of> it.'
    assert all(attributes.get('scope') for attributes in elements.of('th'))
    assert len(elements.of('caption')) == len(elements.of('table'))
    ids = [attributes['id'] for _, attributes in elements.starts if 'id' in attributes]
    assert len(ids) == len(set(ids))
    assert {link['href'][1:] for link in elements.of('a')} == set(ids)


def test_all_that_comes_from_data_is_escaped(tmp_path):
    evil = '<script>alert("1")</script>'
    trials = cell(evil, '40', 'world', rows(10, 10), varied=((evil, evil),))
    trials[0] = trials[0]._replace(outcome=Outcome.LOST, reason=evil)
    made = dataset(trials)._replace(
        title=evil,
        notes=[evil],
        folder=tmp_path,
        manifest={**manifest(), 'configuration': {'tests': [], 'evil': evil, 'nav': evil}},
    )
    assert len(Elements(page_of(made, tmp_path)).of('script')) == 1


def test_bags_are_linked_relative_to_the_report(tmp_path):
    bags = [tmp_path / 'results' / 'bags' / 'SL 1.bag', None, tmp_path / 'a&"#?.bag']
    trials = [one._replace(bag=bag) for one, bag in zip(cell('SL', '40', 'world', [IN] * 3), bags)]
    links = bag_links(dataset(trials), tmp_path / 'results' / 'analysis')
    assert links == [('SL 1.bag', '../bags/SL%201.bag'), None, ('a&"#?.bag', '../../a%26%22%23%3F.bag')]


@pytest.mark.parametrize(
    'trials',
    [
        [trial('SL', '40', 1, outcome=Outcome.LOST)],
        [trial('SL', 'ideal', 1, odom=IN)],
        [trial('own', '12.5', 1, world=IN), trial('own', '90L1024R', 1, odom=IN)],
        [*cell('SL', '40', 'world', [IN] * 2), *cell('DLD', '90', 'world', [OUT])],
    ],
    ids=['no pose', 'ideal', 'own test', 'uneven'],
)
def test_odd_datasets_have_a_page(tmp_path, trials):
    Elements(page_of(dataset(trials), tmp_path))


def test_equal_data_gives_equal_bytes(tmp_path, figure):
    made = dataset(both('SL', '40', (20, 10), (15, 15)), both('SL', '90', (20, 10), (15, 15)))
    assert page_of(made, tmp_path, [figure]) == page_of(made, tmp_path, [figure])


def test_the_smaller_form_of_a_figure_is_taken(figure):
    assert data_uri(figure.svg, figure.png).startswith('data:image/svg+xml,%3Csvg xmlns')
    figure.png.write_bytes(b'\x89PNG')
    assert data_uri(figure.svg, figure.png) == 'data:image/png;base64,iVBORw=='
