"""Ctrl-C ends any command within two seconds, with a sentence that says what became of its files."""

import os
import signal
import subprocess
import sys
from time import monotonic

import pytest

from tests.support import ROOT, run
from wheelpend import Model, interruption
from wheelpend.model import workspace
from wheelpend.model.transaction import MADE_FOLDER

NOTHING = "Interrupted; nothing was changed.\n"
HELD_UP = """
import hashlib, sys, threading
from pathlib import Path
from wheelpend import interruption
from wheelpend.files import replacing, write_text
interruption.watch()
write_text(Path("whole.txt"), "whole")
with replacing(Path("half.txt")) as partial:
    partial.write_text("half")
    threading.Timer(0.5, lambda: print("ready", file=sys.stderr, flush=True)).start()  # while that is at work:
    hashlib.pbkdf2_hmac("sha256", b"", b"", (1 << 31) - 1)  # as compiled code: minutes in which Python sees no signal
"""


@pytest.fixture(autouse=True)
def heeded():
    """Ctrl-C as in a terminal; behind an ampersand a shell without job control has it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted(*command, folder):
    """Exit code, standard error and seconds until the end of a process that gets Ctrl-C once it is ready."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr.readline() == "ready\n"
            begin = monotonic()
            process.send_signal(signal.SIGINT)
            said = process.communicate(timeout=60)[1]
        finally:
            process.kill()
    return process.returncode, said, monotonic() - begin


def test_ctrl_c_ends_what_holds_the_main_thread_and_leaves_no_partial_file(tmp_path):
    code, said, seconds = interrupted(sys.executable, "-c", HELD_UP, folder=tmp_path)
    assert (code, said) == (130, "Interrupted. Written before that: whole.txt.\n") and seconds < 2.5
    assert [p.name for p in tmp_path.iterdir()] == ["whole.txt"]


@pytest.mark.parametrize("loop", ["while True: pass", "import time; time.sleep(1000)",
                                  "while True:\n  try: time.sleep(1)\n  except BaseException: pass"])  # fmt: skip
def test_ctrl_c_ends_a_command_in_whatever_a_plants_file_loops(tmp_path, loop):
    (tmp_path / "plant.py").write_text(f"import sys, time\nprint('ready', file=sys.stderr, flush=True)\n{loop}\n")
    command = [sys.executable, "-m", "wheelpend", "new", "robot", "--plant", "plant.py"]
    code, said, seconds = interrupted(*command, folder=tmp_path)
    assert (code, said) == (130, NOTHING) and seconds < 2.5
    assert [p.name for p in tmp_path.iterdir() if p.suffix != ".py"] in ([], ["__pycache__"])


def test_an_interruption_is_said_in_one_sentence_with_one_exit_code(tmp_path, monkeypatch):
    def interrupt(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path)
    (tmp_path / "log.csv").write_text("t\n0\n")
    monkeypatch.setattr("wheelpend.identification.identify.identify", interrupt)
    assert run("identify", "log.csv", code=130).stderr == NOTHING


def test_a_change_that_is_being_moved_into_place_is_finished_before_ctrl_c_ends_the_command(tmp_path, monkeypatch):
    model = workspace.create(tmp_path)
    changed = model.with_effects(["slope"])
    workspace.generated_code(changed)  # so that it is derived already
    interruption.begin_command()
    replace = os.replace

    def interrupting(source, target):
        os.kill(os.getpid(), signal.SIGINT)
        replace(source, target)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("os.replace", interrupting)
        workspace.save(changed, opened=model)
    assert Model.open(tmp_path).effects == ("slope",) and not (tmp_path / MADE_FOLDER).exists()
    assert str(tmp_path / "model.toml") in interruption.sentence()
