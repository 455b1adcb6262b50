"""What ``--help`` shows under each command: commands as they are typed, and what they are for."""

from __future__ import annotations

__all__ = ["EXAMPLES", "epilog"]

_BASE = "models/base.scenario.yaml"

EXAMPLES: dict[str, tuple[tuple[str, str], ...]] = {
    "run": (
        (f"run {_BASE}", "plan, simulate and record into out/base/"),
        (f"run {_BASE} --gains table_2 --out out/paper", "with the paper's gains, elsewhere"),
        (f"run {_BASE} --live", "watch it in a browser while it is simulated"),
        (f"run {_BASE} --json --quiet", "one JSON object for machines"),
    ),
    "plan": (
        (f"plan {_BASE}", "write out/base/plan.json and table_1.md"),
        ("plan models/closed.scenario.yaml", "exit code 3 and a certificate: there is no way"),
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
    ),
    "show": (
        (f"show {_BASE}", "a picture of floor, start and goal"),
        (f"show {_BASE} --plan out/base/plan.json --out base.svg", "with the plan's channel"),
    ),
    "diagram": ((f"diagram {_BASE} --robot 1", "the blocks of the loop and of the second robot"),),
    "reproduce": ((f"reproduce {_BASE}", "the paper's tables and figures beside ours"),),
    "maps": (("maps", "where solved maps are kept"), ("maps --clear", "forget them")),
    "warm": ((f"warm {_BASE}", "compile all kernels ahead"),),
    "schema": (
        ("schema --out scenario.schema.json", "for editors"),
        ("schema", "the same on standard output"),
    ),
    "compare": ((f"compare {_BASE}", "rigid grasps beside grasps as constraints"),),
    "tune": ((f"tune {_BASE}", "gains for this scenario, into a file that --gains takes"),),
    "doctor": (("doctor", "a table of what works"), ("doctor --json", "the same for machines")),
    "bench": (("bench planner --only base --seeds 3", "a part of the benchmarks"),),
}
"""For each command its examples, without the program's name, and what each does."""


def epilog(command: str) -> str:
    """The examples of a command as text for the end of its help; blank lines keep them apart."""
    lines = [f"coop-drake {line}  [dim]{what}[/]" for line, what in EXAMPLES[command]]
    return "\n\n".join(["[bold]Examples[/]", *lines])
