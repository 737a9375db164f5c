"""What TAB offers after the commands, in bash and in zsh."""

import re
import shutil
import subprocess
import sys

import pytest

from diff_encoder_sim.cli.console import COMMANDS
from places import CONFIG, ROOT

COMPLETION = CONFIG / 'shell' / 'completion.bash'
SHELLS = [
    pytest.param(shell, marks=pytest.mark.skipif(shutil.which(shell) is None, reason=f'there is no {shell}'))
    for shell in ('bash', 'zsh')
]
# rosrun as it starts a command, and another package's; in zsh arrays begin at 0 where bashcompinit calls.
SCRIPT = """
source {completion}
rosrun() {{ echo "$2" >>{log}; PYTHONPATH={root}/src {python} {root}/scripts/"$2" "$3"; }}
_roscomplete_exe() {{ [ "${{COMP_WORDS[2]}}" = map_b ] || COMPREPLY=(of ROS); }}
compcall() {{ :; }}
diff-encoder-sim() {{ rosrun diff_encoder_sim "${{1//-/_}}" "$2"; }}
tab() {{
  [ -z "${{ZSH_VERSION:-}}" ] || emulate -L sh -o ksh_arrays
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
  case $1 in rosrun) _diff_encoder_sim_rosrun ;; *) _diff_encoder_sim_console ;; esac
  echo "${{COMPREPLY[*]}}"
}}
"""

TABS = {
    ('rosrun', 'diff_encoder_sim', 'campaign', '--rec'): ['--record'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--record', ''): ['full', 'minimal', 'none'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--record', 'm'): ['minimal'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--robot', 'b'): ['burger'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--tests', 'SL', 'SM'): ['SMT'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--config', 'pa'): ['paper', 'paper_tb3'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--encoders', 'amt'): ['amt102'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--encoders', 'amt102', 'cat'): ['catalogue'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--amcl', 'amcl_'): ['amcl_accurate'],
    ('rosrun', 'diff_encoder_sim', 'campaign', '--out', '/etc/host'): [],  # the shell itself offers files
    ('rosrun', 'diff_encoder_sim', 'amcl_node', '--h'): [],
    ('rosrun', 'diff_encoder_sim', 'cam'): ['of', 'ROS'],
    ('rosrun', 'diff_encoder_sim', 'map_b'): ['map_bag'],  # ROS has found nothing
    ('rosrun', 'another', 'campaign', '--rec'): ['of', 'ROS'],
    ('diff-encoder-sim', 'ch'): ['check-robot'],
    ('diff-encoder-sim', 'map-'): ['map-bag'],
    ('diff-encoder-sim', 'campaign', '--rec'): ['--record'],
    ('diff-encoder-sim', 'campaign', '--record', 'mi'): ['minimal'],
}


@pytest.fixture(scope='module', params=SHELLS)
def offered(request, tmp_path_factory):
    """What is offered for each of TABS, and the commands that were asked for help."""
    log = tmp_path_factory.mktemp('completion') / 'asked'
    lines = [SCRIPT.format(completion=COMPLETION, root=ROOT, python=sys.executable, log=log)]
    lines += [f'tab {" ".join(repr(word) for word in words)}' for words in TABS]
    shell = subprocess.run([request.param, '-c', '\n'.join(lines)], capture_output=True, text=True, check=True)
    assert shell.stderr == ''
    return dict(zip(TABS, (line.split() for line in shell.stdout.splitlines()))), log.read_text().split()


@pytest.mark.parametrize('words', TABS, ids=' '.join)
def test_tab_offers(words, offered):
    assert offered[0][words] == TABS[words]


def test_help_is_asked_for_once_and_never_of_a_node(offered):
    assert offered[1] == ['campaign']


def test_every_command_is_completed():
    """Those of docs/commands.md, and of diff-encoder-sim."""
    text = COMPLETION.read_text()
    console, of_ros = (
        re.search(f"^_diff_encoder_sim_{name}='(.*)'$", text, re.MULTILINE)[1].split()
        for name in ('commands', 'of_ros')
    )
    documented = re.findall('^## (.*)$', (ROOT / 'docs' / 'commands.md').read_text(), re.MULTILINE)
    assert sorted(console) == sorted(COMMANDS)
    assert sorted(console + of_ros) == sorted(documented)
