"""Files that are written complete or not at all."""

import os
from pathlib import Path

import pytest

from wheelpend import Failure
from wheelpend.files import rename, replacing, write_files, write_text


def test_a_text_keeps_its_line_ends(tmp_path):
    write_text(tmp_path / "a.txt", "ü\r\n")
    assert (tmp_path / "a.txt").read_bytes() == "ü\r\n".encode()


def test_a_symbolic_link_is_followed_to_its_file(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link.txt").symlink_to(tmp_path / "there" / "file.txt")
    write_text(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink() and os.listdir(tmp_path / "there") == ["file.txt"]


def test_what_fails_leaves_the_old_file_and_nothing_beside_it(tmp_path):
    write_text(tmp_path / "a.txt", "old")
    with pytest.raises(KeyError), replacing(tmp_path / "a.txt") as partial:
        partial.write_text("half")
        raise KeyError
    assert os.listdir(tmp_path) == ["a.txt"] and (tmp_path / "a.txt").read_text() == "old"


def test_several_files_are_written_all_or_none(tmp_path):
    (tmp_path / "folder").mkdir()
    with pytest.raises(Failure, match="cannot be written: Is a directory"):
        write_files(tmp_path, {"a.txt": b"1", "folder": b"2"})
    assert os.listdir(tmp_path) == ["folder"]


def test_a_folder_that_is_not_there_is_said_with_what_to_do(tmp_path):
    with pytest.raises(Failure, match=r"a\.txt cannot be written: No such file.*name another"):
        write_text(tmp_path / "absent" / "a.txt", "")
    with pytest.raises(Failure, match=r"b\.txt cannot be written: No such file"):
        rename(tmp_path / "a.txt", "b.txt")


def test_a_pipe_or_a_device_is_not_replaced_by_a_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(Failure, match="cannot be written: a device, pipe or socket is no file"):
        write_text(tmp_path / "pipe", "text")
    assert (tmp_path / "pipe").is_fifo() and os.listdir(tmp_path) == ["pipe"]
    with pytest.raises(Failure, match="/dev/null cannot be written"), replacing(Path(os.devnull)):
        pytest.fail("a device must be refused before anything is written")
