"""Parameters under slam_gmapping's names."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import split_params
from diff_encoder_sim.localization.slam_params import GridSlamParams

# Of slam_gmapping's source (Noetic); maxRange and maxUrange follow the scan there.
# fmt: off
UPSTREAM = dict(
    sigma=0.05, kernelSize=1, lstep=0.05, astep=0.05, iterations=5, lsigma=0.075, ogain=3.0, lskip=0,
    minimumScore=0.0, srr=0.1, srt=0.2, str=0.1, stt=0.2, linearUpdate=1.0, angularUpdate=0.5, temporalUpdate=-1.0,
    resampleThreshold=0.5, particles=30, xmin=-100.0, ymin=-100.0, xmax=100.0, ymax=100.0, delta=0.05,
    occ_thresh=0.25, llsamplerange=0.01, llsamplestep=0.01, lasamplerange=0.005, lasamplestep=0.005, throttle_scans=1,
    map_update_interval=5.0, transform_publish_period=0.05, base_frame='base_link', map_frame='map',
    odom_frame='odom',
)
# fmt: on


def test_defaults_are_upstreams():
    defaults = GridSlamParams().model_dump(by_alias=True)
    assert {key: defaults[key] for key in UPSTREAM} == UPSTREAM
    assert set(defaults) - set(UPSTREAM) == {'maxRange', 'maxUrange', 'tf_delay'}


def test_str_is_a_key_like_others():
    assert split_params({'str': 0.3, 'srr': 0.2}, 'node', GridSlamParams)[0].str_ == 0.3
    with pytest.raises(ConfigError, match=r'^node: str: given -1.0; allowed: 0 to 100'):
        GridSlamParams.from_mapping({'str': -1.0}, 'node')
    with pytest.raises(ConfigError, match=r"str_: unknown key; did you mean 'str'"):
        split_params({'str_': 0.3}, 'node', GridSlamParams)
