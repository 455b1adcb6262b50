"""No answer rests on what a model's files once said: a question and a digest follow what Drake reads."""

import pytest

from coop_drake.answers.digest import problem_digest
from coop_drake.cli.task import read_task
from coop_drake.plant.facts import models_digest, scenario_digest
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import MODELS, exchanged, write_edited

ROBOT = "package://coop_drake_models/long_blue.sdf"
MESH = "v 0 0 0\nv 0.1 0 0\nv 0 {y} 0\nv 0 0 0.1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
WITH_MESH = (
    "<collision name='tip'><pose>0.1 0 0.2 0 0 0</pose><geometry><mesh>{uri}</mesh></geometry>"
    "</collision>\n    <collision"
)


def write_team(folder, uri="<uri>tip.obj</uri>", edits=()):
    """The base scenario with a robot of its own, whose collision geometry has a mesh."""
    parts = folder / "parts"
    parts.mkdir(parents=True, exist_ok=True)
    model = exchanged(
        (MODELS / "long_blue.sdf").read_text(), ("<collision", WITH_MESH.format(uri=uri)), *edits
    )
    (parts / "arm.sdf").write_text(model)
    (parts / "tip.obj").write_text(MESH.format(y=0.1))
    return write_edited(folder, (ROBOT, "parts/arm.sdf"))


@pytest.mark.parametrize(
    "uri",
    [
        "<uri>tip.obj</uri>",
        "<uri><![CDATA[tip.obj]]></uri>",
        "<uri><!-- the tip -->tip.obj</uri>",
        "<uri>tip&#46;obj</uri>",
    ],
)
def test_a_mesh_that_grows_asks_another_question_however_it_is_named(uri, tmp_path):
    path = write_team(tmp_path, uri)
    before, models = read_task(path).problem, models_digest(load_scenario(path))
    (tmp_path / "parts" / "tip.obj").write_text(MESH.format(y=0.3))
    assert problem_digest(read_task(path).problem) != problem_digest(before)
    assert models_digest(load_scenario(path)) != models


def test_a_digest_of_models_sees_what_a_run_takes_from_them_and_not_where_they_are(tmp_path):
    edits = [
        (),
        (("<mass>6</mass>", "<mass>6.1</mass>"),),
        (("</limit>", "</limit><dynamics><damping>1</damping></dynamics>"),),
        (("</limit>", "<effort>7</effort></limit>"),),
        (("</limit>", "</limit><dynamics><spring_stiffness>1</spring_stiffness></dynamics>"),),
        (("</limit>", "</limit><dynamics><spring_stiffness>2</spring_stiffness></dynamics>"),),
    ]
    paths = [write_team(tmp_path / str(place), edits=edit) for place, edit in enumerate(edits)]
    paths += [write_team(tmp_path / "elsewhere" / "same")]
    scenarios = [load_scenario(path) for path in paths]
    digests = [models_digest(one) for one in scenarios]
    assert digests[-1] == digests[0]
    assert len(set(digests)) == len(edits)
    assert len({scenario_digest(one) for one in scenarios}) == len(edits)
    assert scenario_digest(scenarios[0], digests[1]) == scenario_digest(scenarios[1])
