"""How a robot stops, in words."""

from diff_encoder_sim.trials.robot_params import as_upstream, load_robot_config, override, stopping_line
from diff_encoder_sim.wheels.encoder_params import PerWheel
from places import CONFIG

STOP = 'navigation.DWAPlannerROS.stop'


def ppr(left, right=None):
    return PerWheel(left=left, right=right or left)


def params(**changes):
    return override(load_robot_config(CONFIG), {STOP: 'precise', **changes})


def test_the_finest_and_the_coarsest_encoder_are_named():
    assert stopping_line(params(), [ppr(90), ppr(4096), ppr(40)]) == (
        'stopping: precise drives up to within about 6 mm and 1.0 degrees of the goal with 4096 PPR, '
        '19 mm and 3.0 degrees with 40 PPR; asked for: 50 mm and 3.0 degrees'
    )
    assert ' PPR' not in stopping_line(params(), [ppr(90)])


def test_the_coarser_wheel_counts():
    assert stopping_line(params(), [ppr(40, 4096)]) == stopping_line(params(), [ppr(40)])


def test_latch_spends_the_tolerance_whatever_the_encoder():
    line = 'stopping: latch ends anywhere within {} mm and 3.0 degrees of the goal; asked for: 50 mm and 3.0 degrees'
    assert stopping_line(params(**{STOP: 'latch'}), [ppr(40), ppr(4096)]) == line.format(40)
    assert stopping_line(as_upstream(params()), [ppr(40)]) == line.format(50)


def test_a_later_command_counts():
    late = params(**{'lockstep.command': 0.2})
    assert 'within about 11 mm' in stopping_line(late, [ppr(4096)])
