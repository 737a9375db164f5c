"""Garbage collection is off within the statement alone, however it ends, and stays off where it was."""

import gc

import pytest

from diff_encoder_sim.base.processes import without_collection


@pytest.fixture(autouse=True)
def restored():
    yield
    gc.enable()


def test_it_is_off_within_and_on_after():
    with without_collection():
        assert not gc.isenabled()
    assert gc.isenabled()


def test_it_is_on_again_after_an_error():
    with pytest.raises(ValueError, match='as asked'):
        with without_collection():
            raise ValueError('as asked')
    assert gc.isenabled()


def test_it_stays_off_where_it_was_off():
    gc.disable()
    with without_collection():
        pass
    assert not gc.isenabled()
