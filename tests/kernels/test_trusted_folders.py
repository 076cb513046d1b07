"""No cache that others could have written, or could exchange, is used."""

import os
import tempfile
from pathlib import Path

import pytest

from wheelpend.kernels import cache_folder as cache
from wheelpend.kernels.first_use import first_use_notice


@pytest.fixture(autouse=True)
def places(tmp_path, monkeypatch):
    """Folders of one's own for the cache and for temporary files, and a process that has said nothing."""
    own = tmp_path / "temporary"
    own.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(own))
    monkeypatch.setenv("WHEELPEND_CACHE", str(tmp_path / "stated"))
    forget()
    yield tmp_path
    forget()


def forget():
    cache._trusted_folder.cache_clear()
    cache._passing_folder.cache_clear()
    first_use_notice().printed.clear()


@pytest.mark.parametrize("mode", [0o770, 0o707])
def test_a_cache_that_others_can_write_is_not_used_and_another_is_taken(places, capsys, mode):
    folder = places / "stated" / "wheelpend"
    folder.mkdir(parents=True)
    folder.chmod(mode)
    assert cache.cache_folder().parent == places / "temporary"
    assert cache.cache_folder().parent == places / "temporary"
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"{folder} is not used as a cache, because it can be written by others" in said


@pytest.mark.parametrize(
    ("mode", "reason"), [(0o777, "written by them"), (0o1777, ""), (0o755, ""), (0o775, "written")]
)
def test_a_folder_above_the_cache_lets_nobody_exchange_it(places, monkeypatch, mode, reason):
    monkeypatch.setattr(cache, "_is_own_group", lambda number: False)
    places.chmod(mode)
    found = cache._distrust_parent(places, places.stat())
    assert reason in found and bool(reason) == bool(found)


def test_the_group_that_a_user_has_alone_may_write_above_the_cache(places, monkeypatch):
    monkeypatch.setattr(cache, "_is_own_group", lambda number: number == places.stat().st_gid)
    places.chmod(0o775)
    assert cache._distrust_parent(places, places.stat()) == ""
    places.chmod(0o777)
    assert cache._distrust_parent(places, places.stat())


def test_a_folder_above_the_cache_does_not_belong_to_yet_another_user(places, monkeypatch):
    own, status = os.getuid(), places.stat()
    monkeypatch.setattr(os, "getuid", lambda: own + 1)
    other = os.stat_result((status.st_mode, 0, 0, 1, own + 2, 0, 0, 0, 0, 0))
    assert "belongs to another user" in cache._distrust_parent(places, other)


def test_behind_a_folder_that_keeps_others_out_it_does_not_matter_who_may_write(places):
    folder = places / "closed" / "open" / "cache"
    folder.mkdir(parents=True, mode=0o700)
    folder.parent.chmod(0o777)
    folder.parents[1].chmod(0o700)
    assert cache.distrust(folder) == ""


def test_a_cache_of_another_user_is_not_used(places, monkeypatch):
    places.chmod(0o700)
    assert cache.distrust(places) == ""
    monkeypatch.setattr(os, "getuid", lambda: places.stat().st_uid + 1)
    assert "belongs to another user" in cache.distrust(places)


def test_where_no_folder_can_be_trusted_one_is_made_for_this_process_and_those_it_starts(places, monkeypatch, capsys):
    monkeypatch.setattr(cache, "distrust", lambda folder: "" if "wheelpend-" in folder.parent.name else "is open")
    folder = cache.cache_folder()
    assert folder.parent.parent == places / "temporary" and folder.stat().st_mode & 0o077 == 0
    assert Path(os.environ["WHEELPEND_CACHE"]) == folder.parent and cache.cache_folder() == folder
    assert capsys.readouterr().err.count("is not used as a cache, because it is open.") == 2


def test_a_temporary_folder_that_is_the_current_one_holds_nothing_to_be_executed(places, monkeypatch):
    monkeypatch.chdir(places / "temporary")
    assert [p.parent for p in cache._possible_folders("", "/somewhere")] == [Path("/somewhere")]


def test_a_folder_that_is_named_relative_to_the_current_one_must_be_meant(places, monkeypatch):
    monkeypatch.chdir(places)
    assert next(cache._possible_folders("here", "")) == places / "here" / "wheelpend"
    assert places not in next(cache._possible_folders("", "here")).parents  # XDG_CACHE_HOME is to be ignored then


def test_a_folder_made_for_the_cache_can_be_written_by_nobody_else(places):
    before = os.umask(0)
    try:
        (places / "stated").mkdir(mode=0o700)
        assert cache.cache_folder().stat().st_mode & 0o077 == 0
    finally:
        os.umask(before)
