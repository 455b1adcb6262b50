"""Plan, verify and simulate the transport of one object by several mobile manipulators.

The names below are imported when they are first used, so that ``import coop_drake`` takes no time:

    scenario = coop_drake.load_scenario("base")
    answer = coop_drake.plan(scenario)
    maps = coop_drake.build_maps(answer.plan)
    log = coop_drake.simulate(scenario, answer.plan, maps)
"""

from coop_drake.lazy import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
