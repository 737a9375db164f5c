"""Every command of README.md, CONTRIBUTING.md and docs/ runs as written and prints what is shown, or says why not.

DOCUMENTED_OUTPUT=write writes what is printed into the pages, where an output is shown.
"""

import os
import re
import shutil

import pytest

from documented_commands import blocks_of, difference, pages
from launched_graph import ROOT, Graph, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

BLOCKS = [block for path in pages() for block in blocks_of(path)]
TO_RUN = [block for block in BLOCKS if not block.reason_not_to_run]
COPIED = ('config', 'urdf', 'worlds')  # commands may write beside their files
LONGEST_S = 250.0
ESCAPES = re.compile(r'\x1b\[[0-9;]*m|\x1b\][^\x07]*\x07')


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    """Run the commands of a block, each once, in the order of the pages: one may use what one before it made."""
    require_ros()
    folder = tmp_path_factory.mktemp('checkout')
    for entry in ROOT.iterdir():
        if entry.name in COPIED:
            shutil.copytree(str(entry), str(folder / entry.name))
        elif entry.name not in ('results', 'maps', 'bags'):
            (folder / entry.name).symlink_to(entry)
    done = {}
    with Graph(folder / 'ros') as graph:
        graph.environment['PWD'] = str(folder)

        def run_once(command):
            if command not in done:
                script = f'cd {folder}\nsource .ws/devel/setup.bash\nset -e -o pipefail\n{command}\n'
                process = graph.start('bash', '-c', f'({script}) 2>{folder}/stderr')
                code = process.wait(LONGEST_S)
                done[command] = code, process.output(), (folder / 'stderr').read_text(errors='replace')
            return done[command]

        def run(commands):
            """Return the worst status, stdout and stderr of a block; a backslash continues a command."""
            codes, outputs, errors = zip(*map(run_once, re.split(r'(?<!\\)\n', commands)))
            return max(codes), ''.join(outputs), ''.join(errors)

        yield run


@pytest.mark.parametrize('block', TO_RUN, ids=str)
def test_a_documented_command_runs(block, run):
    code, output, errors = run(block.commands)
    assert code == 0, f'{block}:\n{block.commands}\n{output}\n{errors}'
    if block.output is not None:
        if os.environ.get('DOCUMENTED_OUTPUT') == 'write':
            write_output(block, output)
        else:
            assert difference(block.output, output) == '', block


@pytest.mark.parametrize('block', [block for block in BLOCKS if block.reason_not_to_run], ids=str)
def test_a_command_that_is_not_run_names_what_exists(block):
    """A reason may name the test that runs it."""
    for name in re.findall(r'(?:test|\.ci)/[\w./]+', block.reason_not_to_run):
        assert (ROOT / name.rstrip('.')).exists(), block


def write_output(block, output):
    lines = block.path.read_text().splitlines()
    printed = [line.rstrip() for line in ESCAPES.sub('', output).splitlines()]
    # Others have been written before.
    block = next(now for now in blocks_of(block.path) if now.commands == block.commands)
    shown = block.output.splitlines()
    if '...' in shown:
        pytest.skip(f'{block}: a part is shown; write it by hand:\n' + '\n'.join(printed))
    lines[block.output_line - 1 : block.output_line - 1 + len(shown)] = printed
    block.path.write_text('\n'.join(lines) + '\n')
