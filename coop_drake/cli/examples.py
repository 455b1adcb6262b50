"""What ``--help`` shows under each command: commands as they are typed, and what they are for."""

from __future__ import annotations

_BASE = "models/base.scenario.yaml"
_REAL = "real.scenario.yaml"

EXAMPLES: dict[str, tuple[tuple[str, str], ...]] = {
    "run": (
        (f"run {_BASE}", "plan, simulate and record into out/base/"),
        (f"run {_BASE} --gains table_2 --out out/paper", "with the paper's gains, into another folder"),
        (f"run {_BASE} --live", "watch it in a browser while it is simulated"),
        (f"run {_BASE} --json --quiet", "one JSON object for machines"),
    ),
    "plan": (
        (f"plan {_BASE}", "write out/base/plan.json and table_1.md"),
        (f"plan {_BASE} --effort 8", "eight times the work, for a quicker transport"),
        ("plan models/closed.scenario.yaml", "exit code 3 and a proof that there is no plan"),
    ),
    "simulate": (
        (f"simulate {_BASE}", "carry out out/base/plan.json"),
        (f"simulate {_BASE} --plan my_plan.json --gains table_2", "another plan, other gains"),
    ),
    "watch": ((f"watch {_BASE}", "pictures and a page of the search in out/base/think/"),),
    "why": (("why models/closed.scenario.yaml", "what blocks, and what would help"),),
    "verify": (
        (f"verify out/base/plan.json {_BASE}", "check a plan"),
        ("verify out/closed/certificate.json models/closed.scenario.yaml", "check a proof"),
        (f"verify out/base/log.npz {_BASE}", "check a run by its log"),
    ),
    "show": (
        (f"show {_BASE}", "a picture of floor, start and goal"),
        (f"show {_BASE} --plan out/base/plan.json --out base.svg", "with the plan's channel"),
    ),
    "diagram": ((f"diagram {_BASE} --robot 1", "the blocks of the loop and of the second robot"),),
    "reproduce": (
        ("reproduce", "the paper's tables and figures beside ours, into out/reproduction/index.html"),
    ),
    "maps": (("maps", "where solved maps are kept"), ("maps --clear", "forget them")),
    "warm": ((f"warm {_BASE}", "compile all kernels ahead"),),
    "schema": (
        ("schema --out scenario.schema.json", "for editors"),
        ("schema", "the same on standard output"),
    ),
    "world": (
        (f"world {_REAL}", "with a control rate in it: wait for supervisor and robots, simulate, record"),
    ),
    "robot-node": ((f"robot-node {_REAL} 1", "be the second robot"),),
    "supervisor": ((f"supervisor {_REAL} --addresses keys/addresses.yaml", "be the supervisor"),),
    "keys": (
        ("keys --robots 2 --out keys", "for processes on this machine that prove who they are"),
        ("keys --robots 3 --world 192.168.1.10 --supervisor 192.168.1.11", "for several machines"),
    ),
    "compare": ((f"compare {_BASE}", "rigid grasps beside grasps as constraints"),),
    "campaign": (
        ("campaign many.campaign.yaml", "make all runs, or those that are missing, into out/campaigns/many/"),
        ("campaign status many.campaign.yaml", "how far it is, what was lost, the least margins"),
        ("campaign report many.campaign.yaml", "a page with rates, distributions and the worst runs"),
        ("campaign replay many.campaign.yaml 17", "one of its runs again, with recording and figures"),
    ),
    "tune": (
        (f"tune {_BASE}", "less force in no more time, into out/base/tuned/gains.yaml"),
        (f'tune {_BASE} --criterion time --limit "peak_force<=1x"', "less time with no more force"),
        (f"run {_BASE} --gains out/base/tuned/gains.yaml", "use them"),
    ),
    "doctor": (("doctor", "a table of what works"), ("doctor --json", "the same for machines")),
    "floor-plan": (
        ("floor-plan hall.dxf --unit mm --out hall.png", "look at a drawing"),
        (
            "floor-plan map.yaml --inside 2 3 --tolerance 0.05 --out workspace.yaml",
            "an occupancy map as a scenario's workspace; a scenario may name the file itself, too",
        ),
    ),
    "new": (
        ("new mine --robots 3 --arm 0.3,0.3,0.3 --door 1.6", "a team and two rooms into mine/"),
        ("new hall --floor-plan hall.svg --unit cm --start 1 2 0 --goal 7 2 1.57", "on a floor of your own"),
    ),
    "robot": (
        (
            "robot stretch4.urdf --gripper link_grasp_center --out models/stretch4",
            "model and meshes in one folder with a gripper frame, joints judged, lines for a scenario",
        ),
        (
            "robot pr2.urdf --package pr2_description=../pr2 --fix r_elbow_flex_joint=-0.3 --out models",
            "with a package's folder, and the axes behind a joint that will be fixed",
        ),
    ),
    "object": (
        (
            "object ell --corners '-0.4 -0.25, 0.4 -0.25, 0.4 0, -0.1 0, -0.1 0.25, -0.4 0.25' "
            "--mass 2 --grasps '0.4 -0.125 0, -0.4 0 3.1415926536'",
            "an L with two grasps, into ell.sdf and a mesh for each convex part",
        ),
    ),
    "bench": (
        ("bench", "what there is to measure"),
        ("bench planner --only base --seeds 3", "a part of it"),
        ("bench all", "everything, in about forty minutes"),
    ),
}
"""For each command its examples, without the program's name, and what each does."""


def epilog(command: str) -> str:
    """The examples of a command as text for the end of its help; blank lines keep them apart."""
    lines = [f"coop-drake {line}  [dim]{what}[/]" for line, what in EXAMPLES[command]]
    return "\n\n".join(["[bold]Examples[/]", *lines])
