"""The tutorials: whoever types what they show, in a folder of their own, sees what they show."""

import os
import re
import shlex
import subprocess
import sys

import pytest

from tests.pages import NUMBER, as_pattern, blocks, plain, typed
from tests.support import ROOT

TUTORIALS = ("tutorial_robot", "tutorial_control", "tutorial_paper", "tutorial_embedded", "tutorial_workbench")
TOLERANCE = 0.2  # of a number that is shown: the last digits depend on the machine
LONGEST_S = 1200


@pytest.fixture
def shell(tmp_path):
    """Runs a line as a shell would, with this tree's wheelpend and python on the path."""
    tools, place = tmp_path / "tools", tmp_path / "work"
    tools.mkdir()
    place.mkdir()
    for name, what in (("wheelpend", "-P -m wheelpend"), ("python", "")):
        (tools / name).write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {what} "$@"\n', encoding="utf-8")
        (tools / name).chmod(0o755)
    env = os.environ | {"PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT), "COLUMNS": "80"}

    def run(line):
        nonlocal place
        if line.startswith("cd "):
            place = place / line.removeprefix("cd ")
            return ""
        done = subprocess.run(line, shell=True, cwd=place, env=env, capture_output=True, text=True, timeout=LONGEST_S)
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
        return done.stdout

    def write(name, text):
        (place / name).write_text(text, encoding="utf-8")

    run.write = write
    return run


def is_shown(line, output):
    """Whether a line of a page is one of the output: the same words, and numbers that are near."""
    wanted = NUMBER.findall(line)
    found = filter(None, map(as_pattern(line).fullmatch, map(plain, output.splitlines())))
    return any(all(map(near, wanted, row.groups())) for row in found)


def near(shown, found):
    """Whether two numbers are near; how small a standard error or a p-value is depends on the machine."""
    return "e-" in shown or float(found) == pytest.approx(float(shown), rel=TOLERANCE, abs=1e-3)


def follow(page, shell):
    """Do what a page says, in order."""
    for block in blocks((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")):
        if name := re.match(r"# (\w+\.\w+)\n", block.text):
            shell.write(name[1], block.text)
        for command, shown, _ in typed(block) if block.language == "console" else ():
            output = shell(command)
            missing = [line for line in shown if not is_shown(line, output)]
            assert not missing, f"{command}\nshows no\n{chr(10).join(missing)}\nbut\n{output}"


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS)
def test_a_tutorial_does_what_it_says(page, shell):
    if page == "tutorial_paper":
        pytest.importorskip("matplotlib")
    follow(page, shell)


def test_every_block_of_a_tutorial_is_followed():
    for page in TUTORIALS:
        for block in blocks((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")):
            assert block.language in ("console", "python", "toml")
            assert block.text.startswith("$ " if block.language == "console" else "# "), block.text


def test_a_line_that_the_output_does_not_have_is_noticed():
    output = "Error 78.5 over 0.5 s (noise floor 1): the model misses something.\n│ X1 │  2.0 ± 1e-05 │\n"
    assert is_shown("Error 78.9 over 0.5 s (noise floor 1): the model misses something.", output)
    assert is_shown("Error 78.9 over …", output) and is_shown("│ X1   │ 2.0 ± 3e-06 │", output)
    assert is_shown("… (noise floor 1): …", output) and not is_shown("… (noise floor 3): …", output)
    assert not is_shown("Error 7.85 over 0.5 s (noise floor 1): the model misses something.", output)
    assert not is_shown("Error 78.5 over 0.5 s (noise floor 1): the model explains the log.", output)
