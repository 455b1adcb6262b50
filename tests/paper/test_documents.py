"""The lists in docs/ name things that exist, and every erratum named in the code is explained."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ERRATA = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")
EQUATIONS = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^- \*\*(E\w+)\*\*.*`(test_\S+?)::(\w+)`$", ERRATA, re.MULTILINE)
IDS = {row[0] for row in ROWS}


def test_every_erratum_names_a_test():
    assert len(ROWS) == len(IDS) == len(re.findall(r"^- \*\*E\w+", ERRATA, re.MULTILINE))
    assert len(ROWS) >= 18


@pytest.mark.parametrize(("identifier", "path", "name"), ROWS)
def test_the_guarding_test_exists_and_speaks_of_its_erratum(identifier, path, name):
    source = (ROOT / "tests" / "paper" / path).read_text(encoding="utf-8")
    assert re.search(rf"^(def|class) {name}\b", source, re.MULTILINE)
    assert identifier in source.split('"""')[1]


def test_every_erratum_named_in_the_code_is_in_the_list():
    named = set()
    for path in sorted([*(ROOT / "coop_drake").rglob("*.py"), *(ROOT / "paper").rglob("*.py")]):
        for phrase in re.findall(r"errat(?:a|um) ((?:E\w+(?:, | and )?)+)", path.read_text(encoding="utf-8")):
            named |= set(re.findall(r"E\w+", phrase))
    assert named <= IDS
    assert len(named) > 5


def test_every_equation_of_the_paper_is_listed():
    covered = set()
    for row in re.findall(r"^- ([^:]+):", EQUATIONS, re.MULTILINE):
        for first, last in re.findall(r"\((\d+)\)(?:–\((\d+)\))?", row):
            covered |= set(range(int(first), int(last or first) + 1))
    assert covered == set(range(1, 50))


@pytest.mark.parametrize(("path", "name"), sorted(set(re.findall(r"`(\w+/\w+\.py): (\w+)`", EQUATIONS))))
def test_functions_named_beside_equations_exist(path, name):
    source = (ROOT / "coop_drake" / path).read_text(encoding="utf-8")
    assert re.search(rf"^(def|class) {name}\b", source, re.MULTILINE)
