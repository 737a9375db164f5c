import numpy as np

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import local_defaults
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.navigator_params import DwaParams

along_m = np.arange(0.0, 1.4, 0.025)
plan = np.column_stack([along_m, 0.0 * along_m, 0.0 * along_m])
costmap = Costmap(local_defaults())


def cost(scale):
    planner = DwaPlanner(DwaParams.from_mapping({'slowness_scale': scale}, 'navigation'), 0.05)
    return planner.find_best(IDENTITY, 0.3, 0.0, costmap, plan).cost


assert cost(10.0) > cost(0.0) + 0.1
