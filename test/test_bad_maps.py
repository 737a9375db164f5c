"""A map that cannot be served ends map_server_node with one line: file, key, what was given, what is allowed."""

import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from test_bad_arguments import AWAIT_MASTER, SCRIPTS, run_and_read

from launched_graph import Graph, require_ros  # test_bad_arguments knows where it is

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(200)]

GOOD = {'image': 'good.pgm', 'resolution': '0.05', 'origin': '[0, 0, 0]'}
IMAGES = {'good.pgm': b'P5 2 1 255\n\x00\xfe', 'torn.pgm': b'P5 100 100 255\n\x00\xfe'}

# What is wrong: keys of the YAML file, words of the line
BAD_MAPS = {
    'image missing': ({'image': 'nowhere.pgm'}, ['nowhere.pgm', 'No such file']),
    'image cut off': ({'image': 'torn.pgm'}, ['torn.pgm', 'truncated']),
    'resolution nan': ({'resolution': '.nan'}, ['resolution', 'nan', '0.001 to 100 [m]']),
    'origin of two': ({'origin': '[0, 0]'}, ['origin', '[0, 0]', '3']),
    'thresholds swapped': ({'occupied_thresh': '0.1', 'free_thresh': '0.9'}, ['free_thresh below occupied_thresh']),
}

# What is wrong: arguments ({} is the folder of the files), words of the line
BAD_ARGUMENTS = {
    'no file': ([], ['arguments', 'one map .yaml file']),
    'deprecated': (['{}/good.pgm', '0.05'], ['good.pgm 0.05', 'one map .yaml file, which names the image']),
    'YAML missing': (['{}/nowhere.yaml'], ['nowhere.yaml', 'No such file']),
}


@pytest.fixture(scope='module')
def outcomes(tmp_path_factory):
    """What each bad start ended with. They run side by side."""
    require_ros()
    folder = tmp_path_factory.mktemp('bad_maps')
    for name, content in IMAGES.items():
        (folder / name).write_bytes(content)
    arguments = {
        name: [word.replace('{}', str(folder)) for word in words] for name, (words, _) in BAD_ARGUMENTS.items()
    }
    for index, (name, (keys, _)) in enumerate(BAD_MAPS.items()):
        path = folder / (f'bad_{index}.yaml')
        path.write_text(''.join('{}: {}\n'.format(*pair) for pair in {**GOOD, **keys}.items() if pair[1] is not None))
        arguments[name] = [str(path)]
    with Graph(folder / 'ros') as graph, ThreadPoolExecutor(3) as pool:
        core = graph.start('roscore', '-p', str(graph.port))
        graph.run(sys.executable, '-c', AWAIT_MASTER)
        runs = {
            name: pool.submit(
                run_and_read, graph, [sys.executable, SCRIPTS / 'map_server_node', f'__name:=bad_{index}', *words]
            )
            for index, (name, words) in enumerate(arguments.items())
        }
        yield {name: run.result() for name, run in runs.items()}
        core.send_signal(2)
        core.wait(20.0)


@pytest.mark.parametrize('name', [*BAD_MAPS, *BAD_ARGUMENTS])
def test_map_server_names_what_is_wrong_in_one_line(name, outcomes):
    code, lines = outcomes[name]
    shown = '\n'.join(lines)
    assert code == 1, shown
    assert len(lines) == 1, shown
    for word in {**BAD_MAPS, **BAD_ARGUMENTS}[name][1]:
        assert word in lines[0]
