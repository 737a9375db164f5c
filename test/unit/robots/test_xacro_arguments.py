"""Arguments of a xacro, as they are typed."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments, xacro_arguments_of_text


def test_words_and_texts_give_the_same():
    expected = {'scale': '2', 'name': 'my robot', 'empty': ''}
    assert xacro_arguments(['scale:=2', 'name:=my robot', 'empty:=']) == expected
    assert xacro_arguments_of_text("scale:=2 name:='my robot' empty:=") == expected
    assert xacro_arguments_of_text("scale=2 name='my robot' empty=") == expected
    assert xacro_arguments_of_text('') == {}


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('scale', "robot_args: given 'scale'; allowed: name:=value"),
        (':=2', "given ':=2'"),
        ('a:=1 a:=2', "given 'a' twice; allowed: once"),
        ("a:='1", 'No closing quotation'),
    ],
)
def test_mistakes_are_named(text, expected):
    with pytest.raises(ConfigError) as error:
        xacro_arguments_of_text(text)
    assert expected in str(error.value)
