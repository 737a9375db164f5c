"""test/unit mirrors src/: from a module's path follows its tests'."""

import pytest

from places import ROOT, SOURCE

UNIT, PACKAGE = ROOT / 'test' / 'unit', SOURCE / 'diff_encoder_sim'


@pytest.mark.parametrize('path', sorted(UNIT.glob('*/**/test_*.py')), ids=lambda path: path.name)
def test_a_test_file_is_named_after_a_module(path):
    """ROOM/test_MODULE.py or ROOM/test_MODULE_ASPECT.py, for ROOM/MODULE.py; ROOM/test_ROOM.py for its __init__.py."""
    room = PACKAGE / path.parent.relative_to(UNIT)
    name = path.stem[len('test_') :]
    modules = [room.name if module.stem == '__init__' else module.stem for module in room.glob('*.py')]
    assert [module for module in modules if name == module or name.startswith(f'{module}_')] != []
