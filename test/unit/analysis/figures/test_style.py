"""Colours and axes."""

import numpy as np
import pytest

from diff_encoder_sim.analysis.figures import style


def test_axes_hold_all_but_far_outliers():
    usual = np.linspace(-1.0, 1.0, 29)
    assert style.shown_limit([usual], least=0.1) == pytest.approx(1.08)
    assert 1.0 < style.shown_limit([np.append(usual, 80.0)], least=0.1) < 10.0
    assert style.shown_limit([usual, 5.0 * usual], least=0.1) == pytest.approx(5.4)
    assert style.shown_limit([np.array([])], least=0.1) == 0.1
    assert style.shown_limit([0.01 * usual], least=0.1) == pytest.approx(0.108)
