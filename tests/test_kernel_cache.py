"""Kernels are kept where numba keeps them, and in a temporary folder where it could not."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from coop_drake.cli import kernel_cache
from coop_drake.cli.kernel_cache import keep_kernels_somewhere


@pytest.fixture
def anywhere(monkeypatch, tmp_path):
    """No folder named, nothing that may be written to but the temporary folder."""
    monkeypatch.setattr(kernel_cache.os, "environ", {})
    monkeypatch.setattr(kernel_cache.os, "access", lambda path, mode: False)
    monkeypatch.setattr(kernel_cache.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(kernel_cache.tempfile, "mkdtemp", lambda prefix: str(tmp_path / (prefix + "new")))
    return tmp_path


def named():
    keep_kernels_somewhere()
    return kernel_cache.os.environ.get("NUMBA_CACHE_DIR")


def test_where_nothing_may_be_written_a_folder_of_our_own_is_named(anywhere):
    folder = anywhere / f"coop_drake-kernels-{os.getuid()}"
    assert named() == str(folder)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_a_folder_that_others_may_write_to_is_not_trusted(anywhere):
    folder = anywhere / f"coop_drake-kernels-{os.getuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    assert named() == str(anywhere / "coop_drake-kernels-new")


def test_a_link_is_not_trusted(anywhere):
    (anywhere / "elsewhere").mkdir(mode=0o700)
    (anywhere / f"coop_drake-kernels-{os.getuid()}").symlink_to(anywhere / "elsewhere")
    assert named() == str(anywhere / "coop_drake-kernels-new")


def test_a_folder_that_the_user_names_stays(anywhere):
    kernel_cache.os.environ["NUMBA_CACHE_DIR"] = "mine"
    assert named() == "mine"


@pytest.mark.parametrize("place", ["beside", "cache"])
def test_a_place_that_numba_finds_by_itself_is_left_to_it(anywhere, monkeypatch, place):
    package = Path(kernel_cache.coop_drake.__file__).parent
    cache = anywhere / "cache" / "numba"
    monkeypatch.setattr(kernel_cache, "user_cache_path", lambda name: cache)
    may = package if place == "beside" else anywhere
    monkeypatch.setattr(kernel_cache.os, "access", lambda path, mode: Path(path) == may)
    assert named() is None
