"""``python -m docs.generate out/docs`` builds the documentation as a site of HTML pages.

With ``--notebooks DIR`` it has a page for each executed notebook in that folder, see ``make notebooks``.
The pages of scenario and campaign files and of messages are kept in ``docs``, so that they can be read
without the site, too. The galleries that ``python -m docs.gallery out/gallery`` has made beside the site are
part of it.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath
from typing import Any

import yaml

from docs.generate.api_pages import api_pages
from docs.generate.links import first_page, for_site
from docs.generate.message_page import message_page
from docs.generate.notebook_pages import write_notebook_pages
from docs.generate.scenario_page import campaign_page, scenario_page

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PAGES = {"scenario.md": scenario_page, "campaign.md": campaign_page, "messages.md": message_page}
"""The pages of ``docs/reference`` that are made here, and how."""


def main(site: Path, notebooks: Path | None = None) -> int:
    """Write the sources beside the site and build it, with warnings as errors; return the exit code.

    ``notebooks``: a folder of executed notebooks, None for a site without.
    """
    old = [name for name, page in PAGES.items() if _updated(ROOT / "docs" / "reference" / name, page())]
    if old:
        print(f"out of date and updated in docs/reference: {', '.join(old)}", file=sys.stderr)
        return 1
    sources = site.with_name(site.name + "_sources").absolute()
    shutil.rmtree(sources, ignore_errors=True)
    kept_out = shutil.ignore_patterns("generate", "gallery", "*.py", "__pycache__")
    shutil.copytree(ROOT / "docs", sources / "pages", ignore=kept_out)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (sources / "pages" / "index.md").write_text(first_page(readme), encoding="utf-8")
    for path in (sources / "pages").rglob("*.md"):
        place = PurePosixPath(path.relative_to(sources / "pages").as_posix())
        path.write_text(for_site(path.read_text(encoding="utf-8"), place), encoding="utf-8")
    for page in api_pages(ROOT):
        (sources / "pages" / page.path).parent.mkdir(parents=True, exist_ok=True)
        (sources / "pages" / page.path).write_text(page.text, encoding="utf-8")
    settings = yaml.safe_load((HERE / "mkdocs.yml").read_text(encoding="utf-8"))
    settings["site_dir"] = "site"
    if notebooks is not None:
        written = write_notebook_pages(notebooks, sources / "pages" / "notebooks")
        settings["nav"].append({"Notebooks": [f"notebooks/{name}" for name in written]})
    _add_galleries(site.with_name("gallery"), sources / "pages" / "gallery", settings["nav"])
    settings["nav"].append({"API": [page.path for page in api_pages(ROOT)]})
    python = next(plugin for plugin in settings["plugins"] if "mkdocstrings" in plugin)
    handler = python["mkdocstrings"]["handlers"]["python"]
    handler["paths"] = [str(ROOT)]
    handler["options"]["extensions"] = [str(HERE / "port_tables.py")]
    (sources / "mkdocs.yml").write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")
    build = ["zensical", "build", "--clean", "--strict", "-f", str(sources / "mkdocs.yml")]
    code = subprocess.run([sys.executable, "-m", *build], check=False).returncode
    if code == 0:
        shutil.rmtree(site, ignore_errors=True)
        (sources / "site").rename(site)
        print(f"{site / 'index.html'} is the first page")
    return code


def _add_galleries(made: Path, pages: Path, nav: list[Any]) -> None:
    """Add the galleries to the pages, if ``python -m docs.gallery`` has made them."""
    if made.is_dir():
        shutil.copytree(made, pages)
        nav.insert(1, {"Gallery": "gallery/index.md"})


def _updated(file: Path, text: str) -> bool:
    """Write a file if its content is another one; return whether it was written."""
    if file.exists() and file.read_text(encoding="utf-8") == text:
        return False
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return True


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m docs.generate", description=main.__doc__)
    parser.add_argument("site", type=Path, nargs="?", default=Path("out/docs"), help="folder of the site")
    parser.add_argument("--notebooks", type=Path, metavar="DIR", help="folder of executed notebooks")
    sys.exit(main(**vars(parser.parse_args())))
