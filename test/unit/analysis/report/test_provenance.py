"""The origin of a report."""

from campaign_manifest import manifest
from diff_encoder_sim.analysis.report.origin import provenance
from paper_datasets import dataset


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


def test_a_campaign_of_the_console_command_is_repeated_with_it(tmp_path):
    by_pip = {**manifest()['runs'][0], 'command': ['/venv/bin/diff-encoder-sim', 'campaign', '--out', 'results']}
    origin = provenance(dataset([])._replace(manifest={**manifest(), 'runs': [by_pip]}, folder=tmp_path))
    assert origin.commands == ['diff-encoder-sim campaign --out results', f'diff-encoder-sim analyze {tmp_path}']


def test_bags_alone_have_no_origin_but_the_libraries():
    origin = provenance(dataset([]))
    assert (origin.commands, origin.runs, origin.configuration) == ([], [], None)
    assert origin.facts[0].text.startswith('python ')
