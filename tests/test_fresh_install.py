"""The wheel and the sdist in a fresh environment of every supported Python that is here: sound, and at work."""

import os
import shutil
import subprocess
import sys
import tarfile
from functools import cache
from pathlib import Path

import pytest

from tests.support import ROOT

MINORS = range(11, 20)  # of Python 3
PROBE = "import sys, venv, ensurepip; print(sys.executable, *sys.version_info[:2])"
INSTALL_LIMIT_S, DEMO_LIMIT_S = 1200, 1800


@cache
def pythons():
    """An interpreter for each supported version that is on the machine, by version."""
    names = [shutil.which(f"python3.{minor}") for minor in MINORS]
    beside = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found = {}
    for candidate in [sys.executable, *filter(None, names), *map(str, sorted(beside.glob("3.*/bin/python3")))]:
        done = subprocess.run([candidate, "-c", PROBE], capture_output=True, text=True, cwd=ROOT)
        path, major, minor = done.stdout.split() if done.returncode == 0 else ("", "0", "0")
        if int(major) == 3 and int(minor) in MINORS:
            found.setdefault(f"3.{minor}", path)
    return found


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Both distributions, the wheel made of the unpacked sdist: so it lacks nothing."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "hatchling", "build", "-d", str(folder)]
    subprocess.run([*build, "-t", "sdist"], cwd=ROOT, check=True, capture_output=True)
    (sdist,) = folder.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    (source,) = (folder / "unpacked").iterdir()
    subprocess.run([*build, "-t", "wheel"], cwd=source, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    return {"wheel": wheel, "sdist": sdist}


def test_the_wheel_of_the_sdist_is_that_of_the_checkout(built, tmp_path):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    assert names_in(wheel) == names_in(built["wheel"])


def names_in(wheel):
    import zipfile

    return sorted(zipfile.ZipFile(wheel).namelist())


def installed(version, distribution, folder):
    """The folder of commands of a fresh environment with the distribution and what it needs."""
    subprocess.run([pythons()[version], "-m", "venv", folder], check=True)
    pip = [folder / "bin" / "python", "-m", "pip", "--disable-pip-version-check"]
    done = subprocess.run(
        [*pip, "install", "-q", distribution], capture_output=True, text=True, timeout=INSTALL_LIMIT_S
    )
    if done.returncode and any(word in done.stderr for word in ("No matching distribution", "ConnectionError")):
        pytest.skip(
            f"what the package needs cannot be had for Python {version}: {done.stderr.strip().splitlines()[-1]}"
        )
    assert done.returncode == 0, done.stderr
    subprocess.run([*pip, "check"], check=True)
    return folder / "bin"


@pytest.mark.slow
@pytest.mark.parametrize("distribution", ["wheel", "sdist"])
@pytest.mark.parametrize("version", [f"3.{minor}" for minor in MINORS])
def test_a_fresh_environment_has_a_command_that_tells_its_story(version, distribution, built, tmp_path):
    if version not in pythons():
        pytest.skip(f"Python {version} is not on this machine")
    if distribution == "sdist" and version != min(pythons(), key=lambda v: int(v[2:])):
        pytest.skip("that the sdist makes the same wheel is tested; installing it is tried with one Python")
    commands = installed(version, built[distribution], tmp_path / "environment")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "WHEELPEND"))}
    environment = {**kept, "WHEELPEND_CACHE": str(tmp_path / "cache")}
    command = [commands / "wheelpend", "demo", "--out", "story"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=DEMO_LIMIT_S)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "story" / "report.html").exists() and "coulomb" in done.stdout
    checked = [commands / "wheelpend", "generate", "--check", "--model", "story"]
    subprocess.run(checked, cwd=tmp_path, env=environment, check=True, capture_output=True)
