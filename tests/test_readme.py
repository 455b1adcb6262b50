"""The README's quickstart is short and runs; its links lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def quickstart() -> str:
    (code,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    return code


def test_the_quickstart_has_at_most_six_lines():
    assert len([line for line in quickstart().splitlines() if line.strip()]) <= 6


def test_the_quickstart_runs_and_arrives(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    names: dict[str, object] = {}
    exec(compile(quickstart(), "README.md", "exec"), names)
    assert names["log"].reached
    assert not names["log"].violation
    assert "reached: True" in capsys.readouterr().out


def test_the_two_commands_stand_on_the_first_screen():
    first_screen = "\n".join(README.splitlines()[:24])
    assert "make demo" in first_screen
    assert "make test" in first_screen


def test_every_link_into_the_repository_leads_somewhere():
    targets = re.findall(r"\]\((?!https?:)([^)#]+)\)", README)
    assert targets
    assert [target for target in targets if not (ROOT / target).exists()] == []


def test_every_command_and_file_it_names_is_real():
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"make (\w+)", README):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)
    for name in ("base", "tight", "closed", "three", "elbow"):
        assert (ROOT / "models" / f"{name}.scenario.yaml").exists()
