"""World files: odd SDF is loaded, simulated for a moment, scanned and made into a map."""

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.cli.rasterise_world import main as rasterise
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from odd_values import odd_float, odd_xml, pick
from places import ROOT

TICKS = 3
ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'
SMALL = """<?xml version="1.0"?>
<sdf version="1.6"><world name="small">
  <model name="ground"><static>true</static><link name="link"><collision name="c"><geometry>
    <plane><normal>0 0 1</normal><size>100 100</size></plane></geometry></collision></link></model>
  <model name="wall"><static>true</static><pose>2 0 0.5 0 0 0.3</pose><link name="link"><pose>0 0.5 0 0 0 0</pose>
    <collision name="box"><pose>0 0 0 0 0 0.1</pose><geometry><box><size>0.2 4 1</size></box></geometry></collision>
    <collision name="post"><geometry><cylinder><radius>0.2</radius><length>1</length></cylinder></geometry></collision>
    <collision name="ball"><geometry><sphere><radius>0.3</radius></sphere></geometry></collision></link></model>
</world></sdf>
"""


def warm_up(folder):
    (folder / 'small.world').write_text(SMALL)
    _simulate(folder / 'small.world', Pose2D(0.0, 0.0, 0.0))


def run(rng, folder):
    path = folder / 'odd.world'
    path.write_bytes(odd_xml(rng, SMALL))
    if rng.random() < 0.5:
        free = [repr(abs(odd_float(rng))) for _ in range(2)]  # not below 0: argparse takes -1e-9 for an option
        height_m, side_m = odd_float(rng, 0.2), pick(rng, (0.05, 0.5, odd_float(rng, 0.1)))
        rasterise([str(path), f'--height={height_m}', f'--resolution={side_m}', '--free', *free])
    else:
        _simulate(path, Pose2D(rng.normal(0.0, 3.0), 0.0, 0.1))


def _simulate(path, start):
    simulator = Simulator(path, RobotSource(ROBOT), SimulatorParams(), start, seed=1)
    for _ in range(TICKS):
        simulator.command(0.3, 0.1)
        simulator.tick()
        simulator.physics.obstacle_hit()
    simulator.scan()
    simulator.close()
