"""Files are written whole or not at all."""

import errno
import stat

import pytest

from coop_drake.files import check_readable, remove_unfinished, write_atomically


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


def test_a_full_disk_is_reported_with_the_name_of_the_file(tmp_path):
    def full(file):
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space left") as refused:
        write_atomically(tmp_path / "log.npz", full)
    assert refused.value.filename == str(tmp_path / "log.npz")
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_program_left_is_removed_and_nothing_else(tmp_path):
    for name in (".a.txt.x1y2.part", ".b.txt.x1y2.part", "a.txt", "a.txt.part"):
        (tmp_path / name).write_bytes(b"")
    remove_unfinished(tmp_path, ["a.txt"])
    assert sorted(path.name for path in tmp_path.iterdir()) == [".b.txt.x1y2.part", "a.txt", "a.txt.part"]


@pytest.mark.parametrize(
    ("name", "finding"),
    [
        ("/dev/zero", "a device or a pipe"),
        ("folder", "a folder"),
        ("big", "at most 1 MB"),
        ("none", "No such"),
    ],
)
def test_a_file_that_cannot_be_read_in_whole_is_refused_at_once(name, finding, tmp_path):
    (tmp_path / "folder").mkdir()
    with (tmp_path / "big").open("wb") as file:
        file.truncate(2_000_000)
    with pytest.raises(OSError, match=finding) as refused:
        check_readable(tmp_path / name, 1.0)
    assert refused.value.filename == str(tmp_path / name)
