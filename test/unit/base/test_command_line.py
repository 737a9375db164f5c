"""How tools end, and the form of their help."""

import pytest

from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_version


def ending(error):
    """What a tool that raises `error` exits with."""

    def tool():
        raise error

    with pytest.raises(SystemExit) as ended:
        run_tool('tool', tool)
    return ended.value.code


def test_a_users_mistake_is_one_line_and_status_1():
    assert ending(ConfigError('ppr: given 0; allowed: greater than 0')) == 'tool: ppr: given 0; allowed: greater than 0'


def test_a_reader_that_has_seen_enough_is_no_error():
    assert ending(BrokenPipeError()) == 0


def test_a_lack_of_memory_is_one_line():
    assert ending(MemoryError()) == 'tool: not enough memory'


def test_help_needs_no_docstring():
    """`python -OO` removes them."""
    assert '\n\ntool\n\n' in tool_parser('tool', None, ['x']).format_help()


def test_other_errors_are_not_hidden():
    with pytest.raises(ZeroDivisionError):
        run_tool('tool', lambda: 1 / 0)


def test_version_names_command_and_package(capsys):
    with pytest.raises(SystemExit) as ended:
        tool_parser('tool', 'tool: do it.', ['x']).parse_args(['--version'])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f'tool (diff_encoder_sim) {package_version()}\n'


def test_help_has_filled_paragraphs_and_whole_commands():
    text = tool_parser(
        'tool', 'tool: do it.\n\n' + 'word ' * 40, ['a.bag --out b', ''], notes='note ' * 30
    ).format_help()
    assert '\n\ntool: do it.\n\nword word' in text and 'note note' in text
    assert text.endswith('examples:\n  rosrun diff_encoder_sim tool a.bag --out b\n  rosrun diff_encoder_sim tool\n')
    assert max(map(len, text.splitlines())) <= 80
