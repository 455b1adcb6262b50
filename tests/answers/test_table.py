"""Table 1 as Markdown."""

from coop_drake.answers import table_1
from tests.support.cases import case
from tests.support.synthetic_log import synthetic_plan


def test_every_cell_has_a_row_with_the_bounds_of_every_axis():
    plan = synthetic_plan(case("base"))
    rows = [line for line in table_1(plan).splitlines() if line.startswith("|")]
    cells = [[entry.strip() for entry in row.strip("|").split("|")] for row in rows]
    assert cells[0][:3] == ["cell", "theta lower", "theta upper"]
    assert cells[0][3:] == [f"{name} {bound}" for name in plan.joint_names for bound in ("lower", "upper")]
    assert len(cells) == 2 + len(plan.cells)
    first = [f"{value:.3f}" for k in range(3) for value in (plan.cells[0].lower[k], plan.cells[0].upper[k])]
    assert cells[2] == ["1", *first]
    assert {len(row) for row in cells} == {7}
