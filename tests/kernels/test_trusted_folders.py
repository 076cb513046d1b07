"""Nothing of the current folder is executed or taken for configuration, and no cache that others could have written."""

import os
import subprocess
import sys
import tempfile

import pytest

from wheelpend.kernels import cache

LOAD = "from wheelpend.kernels.load import model_module; model_module('wheel_pendulum', {}, ())"
JOBS = """
import operator
from functools import partial
from wheelpend.parallel import run_all

if __name__ == "__main__":
    print(run_all([partial(operator.add, 1, k) for k in range(4)], lambda done, left: None))
"""


def test_workers_do_not_import_from_the_current_folder(tmp_path):
    script, folder = tmp_path / "jobs.py", tmp_path / "logs"
    folder.mkdir()
    script.write_text(JOBS)
    for name in ("pickle", "threading", "signal"):
        (folder / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nraise SystemExit")
    done = subprocess.run([sys.executable, script], cwd=folder, capture_output=True, text=True)
    assert done.stdout == "[1, 2, 3, 4]\n" and not (tmp_path / "ran").exists()


def test_numba_reads_no_configuration_from_the_current_folder(tmp_path):
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: elsewhere\n")
    code = f"{LOAD}\nimport numba\nassert not numba.config.CACHE_DIR"
    subprocess.run([sys.executable, "-W", "error", "-c", code], cwd=tmp_path, check=True)  # it warns without PyYAML


@pytest.mark.parametrize("mode", [0o770, 0o707])
def test_a_cache_that_others_can_write_is_not_used_and_another_is_taken(tmp_path, monkeypatch, capsys, mode):
    open_folder, own = tmp_path / "wheelpend", tmp_path / "temporary"
    open_folder.mkdir()
    open_folder.chmod(mode)
    own.mkdir()
    monkeypatch.setenv("WHEELPEND_CACHE", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(own))
    cache._folder.cache_clear()
    assert cache.cache_folder().parent == own
    assert f"{open_folder} is not used as a cache, because it can be written by others" in capsys.readouterr().err
    cache._folder.cache_clear()


def test_a_cache_of_another_user_is_not_used(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    assert "belongs to another user" in cache.distrust(tmp_path)
    monkeypatch.undo()
    tmp_path.chmod(0o700)
    assert cache.distrust(tmp_path) == ""


def test_a_folder_made_for_the_cache_can_be_written_by_nobody_else(tmp_path, monkeypatch):
    monkeypatch.setenv("WHEELPEND_CACHE", str(tmp_path / "new"))
    cache._folder.cache_clear()
    before = os.umask(0)
    try:
        assert cache.cache_folder().stat().st_mode & 0o077 == 0
    finally:
        os.umask(before)
        cache._folder.cache_clear()
