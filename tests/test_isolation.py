"""Nothing of the current folder, which may be that of somebody else's logs, is executed or taken for configuration."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import ROOT, simulated
from wheelpend import isolation, save_log

PACKAGE = ROOT / "wheelpend"
NAMES = ("pickle", "numpy", "numba", "matplotlib", "sitecustomize", "threading", "signal", "yaml")
JOBS = """
import operator
from functools import partial
from wheelpend.parallel import run_all

if __name__ == "__main__":
    print(run_all([partial(operator.add, 1, k) for k in range(4)], lambda done, left: None))
"""
COMPILER = """
from wheelpend.kernels.compile_worker import CompileRequest
from wheelpend.kernels.compilers import Compiler

compiler = Compiler()
compiler.begin(CompileRequest("none", "none.py"))
print(compiler.answer(), compiler.is_running)
compiler.end()
"""
OWN_JOBS = JOBS.replace("import operator\n", "import own\n").replace("operator.add, 1", "own.doubled")


@pytest.fixture
def logs(tmp_path):
    """A folder with files that Python and libraries would import, each of which leaves a trace if it runs."""
    folder = tmp_path / "logs"
    folder.mkdir()
    for name in NAMES:
        (folder / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\nraise SystemExit('ran {name}')")
    return folder


def output(*arguments: str | Path, folder: Path, **variables: str) -> str:
    """What a process of Python prints that begins in a folder; it must end without an error."""
    command = [sys.executable, "-W", "error", *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, env=os.environ | variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(("program", "printed"), [(JOBS, "[1, 2, 3, 4]\n"), (COMPILER, "None True\n")])
def test_processes_that_are_started_do_not_import_from_the_current_folder(logs, program, printed):
    script = logs.parent / "program.py"
    script.write_text(program)
    assert output(script, folder=logs) == printed and not (logs.parent / "ran").exists()


def test_the_command_started_as_a_module_does_not_either(logs):
    save_log(logs / "log.csv", simulated(duration=3.0))
    assert "log.csv" in output("-m", "wheelpend", "inspect", "log.csv", folder=logs)
    assert not (logs.parent / "ran").exists()


@pytest.mark.parametrize("program", [["program.py"], ["-m", "program"], ["-m", "mine.program"]])
def test_a_program_of_the_current_folder_brings_its_own_files_to_its_workers(tmp_path, program):
    place = tmp_path / "mine" if "mine.program" in program else tmp_path
    place.mkdir(exist_ok=True)
    (place / "program.py").write_text(OWN_JOBS)
    (tmp_path / "own.py").write_text("def doubled(k):\n    return 2 * k\n")
    assert output(*program, folder=tmp_path) == "[0, 2, 4, 6]\n"


def test_an_empty_entry_of_the_python_path_stands_for_no_folder_and_a_named_one_stays(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", "mine", str(ROOT)]))
    monkeypatch.setattr(sys, "path", [str(tmp_path), "mine", *sys.path])
    assert isolation.python_environment()["PYTHONPATH"] == os.pathsep.join([str(tmp_path / "mine"), str(ROOT)])
    assert isolation.trusted_path()[0] == str(tmp_path / "mine")


def test_what_was_installed_from_the_current_folder_stays_behind_the_standard_library(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", *sys.path, str(tmp_path)])
    found = isolation.trusted_path()
    assert found[-1] == str(tmp_path) and found.count(str(tmp_path)) == 1


def test_in_a_clone_its_folder_does_not_come_in_front_of_the_standard_library(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.setattr(sys, "path", ["", *(p for p in sys.path if Path(p) != ROOT)])
    found = isolation.trusted_path()
    assert found.index(os.path.dirname(os.__file__)) < found.index(str(ROOT)) == len(found) - 2


def test_a_folder_that_was_removed_is_no_obstacle(tmp_path, monkeypatch):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert isolation.current_folder() == "" and isolation.python_environment() and isolation.trusted_path()


CONFIGURATIONS = {
    "matplotlib": ("matplotlibrc", "lines.linewidth: 77\n", "library.rcParams['lines.linewidth'] == 77"),
    "numba": (".numba_config.yaml", "cache_dir: elsewhere\n", "bool(library.config.CACHE_DIR)"),
}


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_library_reads_no_configuration_of_the_current_folder(tmp_path, name):
    file, text, is_read = CONFIGURATIONS[name]
    (tmp_path / file).write_text(text)
    code = f"from wheelpend.isolation import import_configured\nlibrary = import_configured({name!r})\nprint({is_read})"
    assert output("-c", code, folder=tmp_path) == "False\n"  # numba would warn where there is no PyYAML


@pytest.mark.parametrize("place", ["configuration", "."])
def test_a_configuration_that_the_environment_names_is_the_users_own(tmp_path, place):
    (tmp_path / "configuration").mkdir()
    (tmp_path / place / "matplotlibrc").write_text("lines.linewidth: 77\n")
    code = "from wheelpend.isolation import import_configured as i; print(i('matplotlib').rcParams['lines.linewidth'])"
    assert output("-c", code, folder=tmp_path, MATPLOTLIBRC=place) == "77.0\n"


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_such_a_library_is_imported_through_one_door(name):
    pattern = re.compile(rf"^\s*(import|from) {name}\b", re.MULTILINE)
    texts = {p.relative_to(PACKAGE).as_posix(): p.read_text("utf-8") for p in PACKAGE.rglob("*.py")}
    found = {file for file, text in texts.items() if pattern.search(text) and "import_configured(" not in text}
    behind = {"kernels/machine_code.py", "kernels/kernel_files.py"}  # which are imported where it was
    assert found <= behind


def test_python_is_started_in_one_place():
    uses = {"sys.executable": {"isolation.py", "benchmarks/speed/environment.py"}, "get_context(": {"parallel.py"}}
    for what, places in uses.items():
        files = [p for p in PACKAGE.rglob("*.py") if what in p.read_text("utf-8")]
        assert {p.relative_to(PACKAGE).as_posix() for p in files} == places
