"""What a start loads: only what the command at hand needs."""

import subprocess
import sys

import pytest

from tests.support import ROOT, simulated
from wheelpend import Model, save_log

NEVER = {"pydantic", "sympy", "jinja2", "plotly", "matplotlib", "polars", "tomlkit"}
SCIPY = {"scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.special", "scipy.stats"}
LOADED = "import sys; sys.argv = sys.argv[1:]\n{}\nprint(*sys.modules, sep='\\n', file=sys.stderr)"


def loaded(lines: str, *arguments: object) -> set[str]:
    """Modules that a fresh process has loaded after some lines of Python."""
    command = [sys.executable, "-c", LOADED.format(lines), *map(str, arguments)]
    return set(subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT).stderr.splitlines())


def test_the_command_line_itself_loads_nothing_that_takes_long():
    heavy = {"numpy", "numba", "llvmlite", "scipy", *NEVER}
    assert not heavy & loaded("from wheelpend.cli.main import main")


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("start")
    Model.default().save(folder)
    save_log(folder / "log.csv", simulated(duration=3.0))
    return folder


@pytest.mark.parametrize("method", ["shooting", "filtered"])
def test_a_warm_identify_loads_neither_what_derives_nor_what_draws(workspace, method):
    lines = "from wheelpend.cli.main import main\nmain()"
    arguments = ["wheelpend", "identify", workspace / "log.csv", "--model", workspace, "--method", method]
    loaded(lines, *arguments)  # whatever had to be derived or compiled now is
    assert not (NEVER | SCIPY) & loaded(lines, *arguments)


def test_the_list_of_effects_needs_no_derivation(workspace):
    assert not (NEVER | SCIPY | {"numba"}) & loaded(
        "from wheelpend.cli.main import main\nmain()", "wheelpend", "effects"
    )


def test_a_diagnosis_needs_no_derivation_either():
    rooms = "diagnosis.stepwise, wheelpend.diagnosis.missing_force.repeatability, wheelpend.reports.text.diagnosis"
    assert not (NEVER | SCIPY) & loaded(f"import wheelpend.{rooms}")
