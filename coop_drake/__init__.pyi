from .answers import (
    BeyondLimits,
    Found,
    Infeasible,
    Plan,
    PlannerSettings,
    PlanningProblem,
    PlanningResult,
    SimulationLog,
    Undecided,
    load_plan,
    save_plan,
    table_1,
)
from .chain import plan, show, verify, verify_run, why
from .diagnosis import Diagnosis, diagnosis_figure, rows_of, sentences_of
from .diagram import ClosedLoop, build_closed_loop
from .errors import CoopDrakeError
from .floor_plans import FloorPlanSettings, read_floor_plan
from .harmonic_maps import HarmonicMap, MapStore, VelocityField
from .laws import FixedGains, GainSet, ScheduledGains
from .plant import planning_problem
from .scenario import Scenario, dump_scenario, load_scenario
from .simulation import build_maps, communication, simulate
from .viz import (
    LiveView,
    angle_figure,
    block_diagram_figure,
    inline_frame,
    path_figure,
    recording_html,
    summary_figure,
    write_figures,
    write_recording,
)

__all__ = [
    "BeyondLimits",
    "ClosedLoop",
    "CoopDrakeError",
    "Diagnosis",
    "FixedGains",
    "FloorPlanSettings",
    "Found",
    "GainSet",
    "HarmonicMap",
    "Infeasible",
    "LiveView",
    "MapStore",
    "Plan",
    "PlannerSettings",
    "PlanningProblem",
    "PlanningResult",
    "Scenario",
    "ScheduledGains",
    "SimulationLog",
    "Undecided",
    "VelocityField",
    "angle_figure",
    "block_diagram_figure",
    "build_closed_loop",
    "build_maps",
    "communication",
    "diagnosis_figure",
    "dump_scenario",
    "inline_frame",
    "load_plan",
    "load_scenario",
    "path_figure",
    "plan",
    "planning_problem",
    "read_floor_plan",
    "recording_html",
    "rows_of",
    "save_plan",
    "sentences_of",
    "show",
    "simulate",
    "summary_figure",
    "table_1",
    "verify",
    "verify_run",
    "why",
    "write_figures",
    "write_recording",
]
