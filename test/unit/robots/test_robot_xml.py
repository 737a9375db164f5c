"""XML as others write it: what does no harm is read, what could is refused in one line."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.urdf_reading import MOST_BYTES, parse_robot_xml, read_robot_text

ROBOT = '<robot name="r"><link name="a"/></robot>'


def read(folder, content):
    path = folder / 'robot.urdf'
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return parse_robot_xml(read_robot_text(path), str(path))


def refused(folder, content):
    with pytest.raises(ConfigError) as caught:
        read(folder, content)
    text = str(caught.value)
    assert '\n' not in text and text.startswith(str(folder))
    return text


@pytest.mark.parametrize(
    'content',
    [
        f'\n\n <?xml version="1.0"?>\n{ROBOT}',
        f'<!-- the licence -->\n<?xml version="1.0" encoding="utf-8"?>{ROBOT}',
        b'\xef\xbb\xbf<?xml version="1.0"?>' + ROBOT.encode(),
        f'<?xml version="1.0" encoding="UTF-16"?>{ROBOT}'.encode('utf-16'),
        f'<?xml version="1.0" encoding="ISO-8859-1"?><!-- \u00fc -->{ROBOT}'.encode('latin-1'),
        f'<!-- \u00fc -->{ROBOT}'.encode('latin-1'),
        f'<?xml version="1.1"?>{ROBOT}',
        f'<!DOCTYPE robot SYSTEM "http://nowhere.invalid/robot.dtd">{ROBOT}',
        '<robot name="r" xmlns="http://www.ros.org" xmlns:x="http://x"><link name="a" x:b="1"/></robot>',
        '<u:robot name="r" xmlns:u="http://u"><u:link name="a"/></u:robot>',
        '<robot name="r"><link name="a"/><gazebo><sensor:ray name="undeclared"/></gazebo></robot>',
    ],
)
def test_a_form_that_does_no_harm_is_read(tmp_path, content):
    robot = read(tmp_path, content)
    assert (robot.tag, robot.get('name'), robot.find('link').get('name')) == ('robot', 'r', 'a')


def test_an_encoding_that_is_declared_is_used(tmp_path):
    name = '<?xml version="1.0" encoding="iso-8859-1"?><robot name="Gr\u00fcn"/>'.encode('latin-1')
    assert read(tmp_path, name).get('name') == 'Gr\u00fcn'


def test_lines_are_those_of_the_file(tmp_path):
    assert 'robot.urdf, line 5: not well-formed XML: mismatched tag' in refused(
        tmp_path, '\n\n<?xml version="1.0"\n?><robot>\n<link></robot>'
    )


@pytest.mark.parametrize(
    ('content', 'text'),
    [
        ('', 'no element found'),
        ('hello', 'line 1: not well-formed XML: syntax error'),
        (b'\x89PNG\r\n\x1a\n\0\0\0', 'a binary file'),
        (b' ' * (MOST_BYTES + 1), 'too big; allowed: at most 20 MB'),
        (f'<?xml version="1.0" encoding="klingon"?>{ROBOT}', "encoding: given 'klingon'"),
        (f'<?xml version="1.0" encoding="hex"?>{ROBOT}', "encoding: given 'hex'"),
        (f'<?xml version="1.0" encoding="idna"?>{ROBOT}\xfc', "encoding: given 'idna'"),
        ('<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><robot name="&b;"/>', "declares the XML entity 'a'"),
        ('<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot>&a;</robot>', "declares the XML entity 'a'"),
        ('<!DOCTYPE r [<!ENTITY % a SYSTEM "file:///etc/passwd"> %a;]><robot/>', "declares the XML entity 'a'"),
        ('<a>' * 5000 + '</a>' * 5000, 'too much XML'),
        ('<robot>' + '<a/>' * 300_000 + '</robot>', 'too much XML'),
        ('<robot name="&#xD800;"/>', 'invalid character'),
        ('<robot name="\x0c"/>', 'not well-formed'),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else '',
)
def test_what_could_do_harm_is_refused(tmp_path, content, text):
    assert text in refused(tmp_path, content)


def test_what_is_no_file_is_refused(tmp_path):
    for path, text in (
        (tmp_path, 'a folder'),
        (tmp_path / 'none', 'no such robot file'),
        ('/dev/zero', 'no such robot'),
    ):
        with pytest.raises(ConfigError, match=text):
            read_robot_text(path)
