"""Files are written whole or not at all."""

import stat

import pytest

from coop_drake.files import write_atomically


def test_bytes_and_writers_both_serve_and_directories_are_made(tmp_path):
    first = write_atomically(tmp_path / "deep" / "a.bin", b"abc")
    second = write_atomically(tmp_path / "b.bin", lambda file: file.write(b"xyz"))
    assert first.read_bytes() == b"abc"
    assert second.read_bytes() == b"xyz"


def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path):
    target = write_atomically(tmp_path / "a.txt", b"old")

    def interrupted(file):
        file.write(b"half of the new")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(target, interrupted)
    assert target.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_permissions_are_those_of_any_new_file(tmp_path):
    plain = tmp_path / "plain"
    plain.write_bytes(b"")
    written = write_atomically(tmp_path / "written", b"")
    assert stat.S_IMODE(written.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)
