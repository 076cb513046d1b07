"""Python on the pages runs as it stands there, or the page is listed here with the reason why not."""

import ast

import pytest

from tests.pages import PAGES, blocks
from tests.support import ROOT
from wheelpend import Model
from wheelpend.campaigns.manifest import Listed
from wheelpend.campaigns.one_log import Estimate, LogResult
from wheelpend.campaigns.result_set import ResultSet
from wheelpend.model import workspace

ELSEWHERE = {
    "python.md": "runs in test_python_page.py",
    "tutorial_robot.md": "runs in test_tutorials.py",
    "tutorial_control.md": "runs in test_tutorials.py",
    "tutorial_embedded.md": "runs in test_tutorials.py",
    "tutorial_workbench.md": "runs in test_tutorials.py",
    "export_fmu.md": "runs in tests/export/test_fmu.py",
    "plants.md": "whole plants, which run in tests/model/test_user_plants.py and tests/plants/test_further_inputs.py",
    "reproduction.md": "all tables over 100 seeds; `wheelpend reproduce` has tests of its own",
}


def snippets(page):
    return [b.text for b in blocks((ROOT / page).read_text(encoding="utf-8")) if b.language == "python"]


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A folder with what a clone has, and a workspace called robot beside it."""
    for name in ("data", "model.toml", "generated"):
        (tmp_path / name).symlink_to(ROOT / name)
    workspace.create(tmp_path / "robot", "wheel_pendulum", Model.default().text)
    monkeypatch.chdir(tmp_path)


def run_in(names, code, page):
    exec(compile(code, page, "exec"), names)
    return names


def test_the_generated_code_of_the_readme_runs(clone):
    (code,) = (s for s in snippets("README.md") if "from generated" in s)
    assert run_in({}, code, "README.md")["states"].shape == (501, 4)


@pytest.mark.slow
def test_the_story_of_the_readme_runs(clone, capsys):
    (code,) = (s for s in snippets("README.md") if "explain(" in s)
    found = run_in({}, code, "README.md")["found"]
    assert (found.verdict, found.candidates[0].effect) == ("effect_missing", "coulomb_drive")
    assert "+ coulomb_drive: error" in capsys.readouterr().out


def test_the_imports_of_the_page_on_kernels_run(clone):
    (code,) = snippets("docs/kernels.md")
    names = run_in({}, code, "docs/kernels.md")
    assert names["PARAMETERS"] == names["kernels"].PARAMETERS


def test_the_queries_of_the_page_on_fleets_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (code,) = snippets("docs/fleets.md")
    known, listed = ResultSet(tmp_path / "campaign.results", "identify-1"), [Listed(k, f"robot {k}") for k in range(3)]
    with known.held(is_new=True):
        for one in listed:
            known.add(one, LogResult("", error=2.0, parameters={"X1": Estimate(0.5, 0.1), "X2": Estimate(1.0, None)}))
        known.results(listed)
    *first, last = ast.parse(code).body
    names = run_in({}, "\n".join(map(ast.unparse, first)), "docs/fleets.md")
    counted, sizes = (eval(ast.unparse(query), names) for query in (first[-1], last))
    assert counted.rows() == [("identify-1", 3, 2.0)]
    assert sizes.rows() == [(f"robot {k}", 0.5, 0.1) for k in range(3)]


def test_every_page_with_python_is_run_or_listed():
    with_python = {p.name for p in PAGES if any(b.language == "python" for b in blocks(p.read_text(encoding="utf-8")))}
    assert with_python == {"README.md", "kernels.md", "fleets.md", *ELSEWHERE}
