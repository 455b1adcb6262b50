"""``python -m docs.generate out/docs``: the documentation as pages that any browser opens."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import yaml

from docs.generate.api_pages import api_pages
from docs.generate.scenario_page import scenario_page

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def main(site: Path) -> int:
    """Lay out the sources beside the site and build it, warnings being errors; returns the exit code."""
    sources = site.with_name(site.name + "_sources").absolute()
    shutil.rmtree(sources, ignore_errors=True)
    shutil.copytree(
        ROOT / "docs", sources / "pages", ignore=shutil.ignore_patterns("generate", "*.py", "__pycache__")
    )
    pages = {"reference/scenario.md": scenario_page(), **{page.path: page.text for page in api_pages(ROOT)}}
    for path, text in pages.items():
        (sources / "pages" / path).parent.mkdir(parents=True, exist_ok=True)
        (sources / "pages" / path).write_text(text, encoding="utf-8")
    settings = yaml.safe_load((HERE / "mkdocs.yml").read_text(encoding="utf-8"))
    settings["site_dir"] = "site"
    settings["nav"].append({"API": [page.path for page in api_pages(ROOT)]})
    python = next(plugin for plugin in settings["plugins"] if "mkdocstrings" in plugin)
    handler = python["mkdocstrings"]["handlers"]["python"]
    handler["paths"] = [str(ROOT)]
    handler["options"]["extensions"] = [str(HERE / "port_tables.py")]
    (sources / "mkdocs.yml").write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "zensical",
        "build",
        "--clean",
        "--strict",
        "-f",
        str(sources / "mkdocs.yml"),
    ]
    code = subprocess.run(command, check=False).returncode
    if code == 0:
        shutil.rmtree(site, ignore_errors=True)
        (sources / "site").rename(site)
        print(f"{site / 'index.html'} is the first page")
    return code


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/docs")))
