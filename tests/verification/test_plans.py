"""Plans are verified; altered ones are refused, or are true all the same."""

import json
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
import shapely

from coop_drake.answers import save_plan
from coop_drake.answers.document import Document
from coop_drake.answers.plan_file import other_age, read_plan
from coop_drake.errors import PlanError, RefusalError
from coop_drake.planning.planner import plan as make
from coop_drake.verification import verify_file
from tests.support.cases import case
from tests.support.certificates import GAINS, changed, entry_at, number_places, room_with_pillar, write
from tests.support.trees import body_footprints, footprint

PROBLEM = room_with_pillar()


@pytest.fixture(scope="module")
def plan():
    return make(PROBLEM, GAINS["scheduled"], gain_set_name="scheduled").plan


@pytest.fixture(scope="module")
def document(plan, tmp_path_factory):
    path = save_plan(plan, tmp_path_factory.mktemp("plan") / "plan.json")
    return json.loads(path.read_text())


def refusal(document, tmp_path, *, signed=True):
    """What a document is refused for, None where it is verified."""
    try:
        verify_file(write(document, tmp_path / "plan.json", signed=signed), PROBLEM, GAINS)
    except (RefusalError, PlanError) as error:
        return str(error)
    return None


def test_a_plan_is_verified_and_says_what_was_checked(document, tmp_path):
    verified = verify_file(write(document, tmp_path / "plan.json", signed=False), PROBLEM, GAINS)
    assert (verified.answer, verified.subject) == ("found", f"plan of {len(document['cells'])} cells")
    assert all(check.count > 0 for check in verified.checks)


def test_the_plan_of_the_base_case_is_verified(tmp_path):
    problem = case("base")
    plan = make(problem, GAINS["scheduled"], gain_set_name="scheduled").plan
    path = save_plan(plan, tmp_path / "plan.json")
    counts = {check.name: check.count for check in verify_file(path, problem, GAINS).checks}
    pieces, cells = 7, len(plan.cells)
    assert counts["no piece meets a wall at any configuration of any cell"] == pieces * cells
    assert counts["no two pieces of a pair meet at any configuration of any cell"] == 14 * cells


def test_no_number_can_be_altered_be_it_by_a_bit(document, tmp_path):
    places = number_places(document)[::2]
    assert len(places) > 70
    nudges = (lambda x: float(np.nextafter(x, np.inf)), lambda x: 1.001 * x + 1e-3, lambda x: -x - 1.0)
    for number, way in enumerate(places):
        value = nudges[number % 3](entry_at(document, way))
        assert refusal(changed(document, way, value), tmp_path, signed=False), way


@pytest.mark.no_cover
def test_what_is_accepted_under_a_new_digest_is_true(document, tmp_path):
    """Whoever signs again may only state what holds: accepted plans are sampled against exact footprints."""
    places = [way for way in number_places(document) if way[0] != "version"][::9]
    accepted = []
    for number, way in enumerate(places):
        step = (0.004, -0.004, 0.05, -0.05)[number % 4]
        altered = changed(document, way, entry_at(document, way) + step)
        if refusal(altered, tmp_path) is None:
            accepted.append(way)
            assert_true(altered, way)
    assert 0 < len(accepted) < 0.5 * len(places)
    assert {way[0] for way in accepted} <= {"cells", "transitions"}
    claims = {way[2] for way in accepted if way[0] == "transitions"}
    assert claims <= {"inradius", "goal_lower", "goal_upper"}


def assert_true(document, way):
    """Cells hold only free configurations, at their vertices and at extreme and random angles."""
    plan = read_plan(Document("altered", document))
    random = np.random.default_rng(0)
    cells = [plan.cells[way[1]]] if way[0] == "cells" else []
    for cell in cells:
        points = shapely.get_coordinates(cell.tidied)
        for position in points[random.integers(len(points), size=6)]:
            share = np.rint(random.random(len(cell.lower)))
            z = np.concatenate((position, cell.lower + share * (cell.upper - cell.lower)))
            assert PROBLEM.workspace.buffer(1e-9).contains(footprint(PROBLEM.tree, z)), way
            bodies = body_footprints(PROBLEM.tree, z)
            assert all(bodies[a].disjoint(bodies[b]) for a, b in PROBLEM.tree.collision_pairs)


def put(value, *way):
    return lambda document: changed(document, way, value)


def moved(step, *way):
    return lambda document: changed(document, way, entry_at(document, way) + step)


def without(*way):
    def change(document):
        document = deepcopy(document)
        del entry_at(document, way[:-1])[way[-1]]
        return document

    return change


def doubled(*way):
    def change(document):
        document = deepcopy(document)
        entries = entry_at(document, way[:-1])
        entries.insert(way[-1], entries[way[-1]])
        return document

    return change


def swapped(key):
    def change(document):
        document = deepcopy(document)
        document[key][0], document[key][1] = document[key][1], document[key][0]
        return document

    return change


def grown(document):
    """A cell that is five centimetres too large."""
    plan = read_plan(Document("", document))
    ring = shapely.get_coordinates(plan.cells[0].tidied.buffer(0.05, join_style="mitre").exterior)[:-1]
    return changed(document, ("cells", 0, "tidied", "outer"), ring.tolist())


def grown_tidied(document):
    """A cell whose farthest corner is drawn five centimetres outward."""
    way = ("cells", 0, "tidied", "outer")
    ring = np.array(entry_at(document, way))
    out = ring - ring.mean(axis=0)
    far = np.argmax(np.hypot(*out.T))
    ring[far] += 0.05 * out[far] / np.hypot(*out[far])
    return changed(document, way, ring.tolist())


def moved_target(document):
    """A target off its place by a tenth of a millimetre, askew to every wall."""
    x, y = entry_at(document, ("transitions", 0, "target"))
    return changed(document, ("transitions", 0, "target"), [x + 1e-4, y + 2e-4])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (put(["other"], "joint_names"), r"joint_names: \['other'\] is not the scenario's"),
        (moved(1e-9, "start", 0), r"start: .* is not the scenario's"),
        (moved(1e-9, "goal_pose", 1), r"goal_pose: .* is not the scenario's"),
        (put([None], "goal_joints"), r"goal_joints: \[None\] is not the scenario's"),
        (put("0" * 64, "problem"), r"problem: '0+' is not the scenario's digest"),
        (put("table_3", "gain_set"), r"gain_set: 'table_3' is none of scheduled"),
        (put(-1.88, "cells", 0, "lower", 1), r"gains|cells\[0\]: leaves the limits of a joint"),
        (
            moved(0.3, "cells", 0, "upper", 0),
            r"transitions\[0\].gains|cells\[0\]: .* may touch a wall",
        ),
        (grown, r"cells\[0\]: .* may touch a wall"),
        (grown_tidied, r"cells\[0\]: .* may touch a wall|transitions\[0\]"),
        (moved_target, r"transitions\[0\].path: does not lead"),
        (moved(1e-6, "transitions", 0, "inradius"), r"transitions\[0\].inradius: is not positive, or more"),
        (moved(0.05, "transitions", 0, "neck"), r"transitions\[0\].(neck: is not positive, or more|gains)"),
        (put(1e-6, "transitions", 0, "length"), r"transitions\[0\].length: is not that of the path"),
        (put(True, "transitions", 0, "only_angles"), r"transitions\[0\].only_angles: True over"),
        (moved(1e-6, "transitions", 0, "gains", "stiffness"), r"transitions\[0\].gains.stiffness: is"),
        (moved(1e-6, "transitions", 0, "gains", "energy_bound", 1), r"transitions\[0\].gains.energy_bound"),
        (put("exponential", "transitions", 0, "gains", "funnel"), r"transitions\[0\].gains.funnel: is"),
        (
            moved(0.005, "transitions", -1, "goal_upper", 1),
            r"transitions\[1\].goal_lower: leaves a cell or the tolerance",
        ),
        (without("cells", 0), r"transitions: .* expected \d entries, not \d"),
        (without("transitions", 0), r"transitions: .* is not allowed; expected \d entries, not \d"),
        (doubled("cells", 0), r"transitions: .*\d .*entries"),
        (swapped("cells"), r"cells|transitions|start"),
        (swapped("transitions"), r"transitions|cells"),
    ],
)
def test_refusals_under_a_new_digest_say_what_and_where(document, tmp_path, change, message):
    with pytest.raises((RefusalError, PlanError), match=message):
        verify_file(write(change(document), tmp_path / "plan.json", signed=True), PROBLEM, GAINS)


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_a_plan_for_another_deployment_is_refused_with_both_ages_and_the_command(plan, factor, tmp_path):
    gains = {"scheduled": GAINS["scheduled"].for_age(0.0175)}
    made = replace(plan, age_factor=factor, transitions=slowed(plan, factor))
    path = save_plan(made, tmp_path / "plan.json")
    with pytest.raises(RefusalError, match=r"15 ms old, .* these 17\.5 ms old; `coop-drake plan`"):
        verify_file(path, PROBLEM, gains)
    assert other_age(made, GAINS["scheduled"]) == other_age(made, None) == ""


def slowed(plan, factor):
    """The transitions of a plan with a rate gain for older commands."""
    gains = [replace(one.gains, rate_gain=one.gains.rate_gain / factor) for one in plan.transitions]
    return tuple(replace(one, gains=own) for one, own in zip(plan.transitions, gains, strict=True))
