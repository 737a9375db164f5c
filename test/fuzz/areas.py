"""What is fuzzed: an area's cases are made and run by the module that bears its name."""

import fuzz_amcl
import fuzz_bags
import fuzz_campaigns
import fuzz_containers
import fuzz_encoders
import fuzz_lockstep
import fuzz_maps
import fuzz_replay
import fuzz_robots
import fuzz_sources
import fuzz_worlds
from rounds import Area
from sandbox import Limits

AREAS = (
    Area('amcl', fuzz_amcl.run, fuzz_amcl.warm_up),
    Area('encoders', fuzz_encoders.run, fuzz_encoders.warm_up),
    Area('lockstep', fuzz_lockstep.run, fuzz_lockstep.warm_up, Limits(cpu_s=60)),
    Area('worlds', fuzz_worlds.run, fuzz_worlds.warm_up),
    Area('robots', fuzz_robots.run, fuzz_robots.warm_up),
    Area('maps', fuzz_maps.run, fuzz_maps.warm_up),
    Area('bags', fuzz_bags.run, fuzz_bags.warm_up, Limits(cpu_s=60)),
    Area('containers', fuzz_containers.run, fuzz_containers.warm_up, Limits(cpu_s=20, memory_mib=1000)),
    Area('sources', fuzz_sources.run, fuzz_sources.warm_up, Limits(cpu_s=60)),
    Area('campaigns', fuzz_campaigns.run, fuzz_campaigns.warm_up),
)

# On a real graph, where a case takes seconds: by name only, with the workspace sourced.
LIVE_AREAS = (Area('replay', fuzz_replay.run, lambda folder: None),)
