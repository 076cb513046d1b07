"""The wheel and the public names: what a user installs works without the clone around it."""

import subprocess
import sys
import zipfile

import pytest

from tests.support import ROOT


def test_the_public_names_are_what_they_say():
    verbs = "simulate, identify, compare, diagnose, explain, add, report, load_kernels"
    lines = (
        "import wheelpend.diagnosis.compare, wheelpend.diagnosis.explain",
        f"from wheelpend import Model, load_log, {verbs}",
        f"assert all(map(callable, ({verbs})))",
    )
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True)


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    zipfile.ZipFile(wheel).extractall(folder / "site")
    return folder / "site"


def test_the_wheel_installs_package_derivation_templates_and_data_but_no_generated_code_and_no_benchmarks(unpacked):
    names = {p.name for p in unpacked.iterdir()}
    assert {"wheelpend", "derive"} <= names
    assert "generated" not in names
    assert (unpacked / "derive" / "templates" / "module.py.j2").exists()
    assert (unpacked / "wheelpend" / "data" / "demo.csv").exists()
    assert (unpacked / "wheelpend" / "reports" / "page" / "sections" / "header.html.j2").exists()
    assert {p.name for p in (unpacked / "wheelpend" / "reports" / "page" / "plotly_basic").iterdir()} == {
        "LICENSE", "README.md", "plotly-basic.min.js"
    }  # fmt: skip
    assert (unpacked / "wheelpend" / "reproduction" / "gallery.css").exists()
    assert not (unpacked / "wheelpend" / "benchmarks").exists()


def test_the_wheel_starts_a_workspace_and_finds_its_demo_log(unpacked, tmp_path):
    code = (
        f"import sys; sys.path.insert(0, {str(unpacked)!r})\n"
        "import derive, wheelpend.logs.shipped, wheelpend.model.workspace, pathlib\n"
        f"assert derive.__file__.startswith({str(unpacked)!r}), derive.__file__\n"
        "assert wheelpend.logs.shipped.data_folder().joinpath('demo.csv').exists()\n"
        "wheelpend.model.workspace.create(pathlib.Path('robot'))\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    assert (tmp_path / "robot" / "generated" / "wheel_pendulum.py").exists()
