"""Nothing that lies in the current folder or in a workspace is executed or read as configuration by any command."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzz.invariants import fresh_files
from tests.killing import write_state
from tests.support import ROOT

MODULES = (
    "pickle", "numpy", "sitecustomize", "usercustomize", "typing", "json", "random", "signal", "rich", "typer", "sympy", "numba",
    "polars", "plotly", "matplotlib", "jinja2", "tomlkit", "scipy", "yaml", "threadpoolctl", "dask",
    "multiprocessing", "concurrent", "tempfile", "click", "evil_backend", "conftest", "_distutils_hack", "mcap", "rosbags",
)  # fmt: skip
COMMAND = Path(sys.executable).with_name("wheelpend")
WAYS = {"wheelpend": (str(COMMAND),), "python -m": (sys.executable, "-m", "wheelpend")}
QUICK = (
    ("inspect", "log.csv"), ("generate",), ("effects",), ("history",), ("new", "started"),
    ("identify", "log.csv", "--method", "filtered", "--tau", "auto", "--tau-map", "map.png"),
)  # fmt: skip
SLOW = (
    ("compare", "log.csv"), ("simulate", "-o", "made.parquet", "--duration", "1"), ("add", "slope"), ("equations",), ("verify",),
    ("campaign", "log.csv", "log.csv", "--do", "compare"), ("report", "log.csv"), ("warm",), ("reproduce", "figures"),
)  # fmt: skip


@pytest.fixture
def trapped(tmp_path):
    """A workspace full of files that leave a mark where they are executed or obeyed."""
    folder, mark = tmp_path / "workspace", tmp_path / "ran"
    trap = f"open({str(mark)!r}, 'a').write(__file__ + chr(10))\n"
    write_state(folder, fresh_files())
    for name in MODULES:
        (folder / f"{name}.py").write_text(trap)
    for name in ("generated/wheel_pendulum.py", "generated/__init__.py", "templates/module.py.j2"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(trap)
    (folder / ".numba_config.yaml").write_text(f"cache_dir: {mark}\n")
    (folder / "matplotlibrc").write_text(
        f"backend: module://evil_backend\nsavefig.directory: {mark}\nsavefig.dpi: 7\naxes.facecolor: red\n"
    )
    (folder / "pyvenv.cfg").write_text("home = .\n")
    (folder / "evil.pth").write_text(f"import os; {trap}")
    (folder / ".plotly").mkdir()
    return folder


def run_as_a_process(way, command, folder, **environment):
    """Run a command as users do, from a folder."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "MPL"))}
    line = [*WAYS[way], *command]
    return subprocess.run(line, cwd=folder, env={**kept, **environment}, capture_output=True, text=True, timeout=900)


def check_untouched(done, folder):
    assert done.returncode in (0, 1) and "Traceback" not in done.stderr, done.stderr[-2000:]
    mark = folder.parent / "ran"
    assert not mark.exists(), mark.read_text() if mark.is_file() else "a folder was made as its configuration asks"


@pytest.mark.skipif(not COMMAND.exists(), reason="the command is not installed beside this Python")
@pytest.mark.parametrize("command", QUICK, ids=lambda c: c[0])
def test_no_file_of_the_current_folder_is_executed(command, trapped):
    check_untouched(run_as_a_process("wheelpend", command, trapped), trapped)


@pytest.mark.skipif(not COMMAND.exists(), reason="the command is not installed beside this Python")
@pytest.mark.slow
@pytest.mark.parametrize("command", SLOW, ids=lambda c: c[0])
def test_no_file_of_the_current_folder_is_executed_by_a_command_that_takes_long(command, trapped):
    check_untouched(run_as_a_process("wheelpend", command, trapped), trapped)


@pytest.mark.xfail(strict=True, reason="`python -m` looks for modules in the current folder first")
def test_no_file_of_the_current_folder_is_executed_where_python_is_told_to_run_the_package(trapped):
    check_untouched(run_as_a_process("python -m", ("effects",), trapped), trapped)


@pytest.mark.skipif(not COMMAND.exists(), reason="the command is not installed beside this Python")
def test_a_picture_is_the_same_with_a_configuration_in_the_current_folder(trapped):
    run_as_a_process("wheelpend", QUICK[-1], trapped)
    obeyed = (trapped / "map.png").read_bytes()
    (trapped / "matplotlibrc").unlink()
    run_as_a_process("wheelpend", QUICK[-1], trapped)
    assert (trapped / "map.png").read_bytes() == obeyed


@pytest.mark.slow
def test_no_file_of_the_current_folder_is_executed_where_kernels_are_compiled_anew(trapped, tmp_path):
    done = run_as_a_process("wheelpend", ("compare", "log.csv"), trapped, WHEELPEND_CACHE=str(tmp_path / "cache"))
    check_untouched(done, trapped)


def test_a_mark_is_left_where_python_is_told_to_look_in_the_current_folder(trapped):
    subprocess.run(
        [sys.executable, "-c", "import evil_backend"], cwd=trapped, env={**os.environ, "PYTHONPATH": "."}, check=True
    )
    assert (trapped.parent / "ran").exists()


def test_the_commands_that_are_tried_are_commands():
    from tests.fuzz.invariants import COMMANDS

    assert {command[0] for command in (*QUICK, *SLOW)} <= set(COMMANDS) and ROOT.exists()
