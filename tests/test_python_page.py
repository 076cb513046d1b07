"""docs/python.md: its snippets run, and what it says of tables is so."""

import re

import pytest

import wheelpend
from tests.support import ROOT

PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def scope(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clone")
    for name in ("data", "model.toml"):
        (folder / name).symlink_to(ROOT / name)
    names: dict = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for code in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
            exec(compile(code, "docs/python.md", "exec"), names)
    return names


@pytest.mark.slow
def test_the_snippets_of_the_page_run_one_after_the_other(scope):
    assert scope["identified"].to_frame().columns == ["parameter", "value", "sigma", "unit", "identifiable"]
    assert scope["log"].name == "drive"
    assert scope["samples"].columns[:4] == ["t", "segment", "theta_w", "theta_w_predicted"]
    assert scope["linear"].A.shape == (4, 4)


def test_every_verb_that_the_page_names_is_public():
    rows = re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE)
    assert len(rows) == 8 and set(rows) <= set(dir(wheelpend))


def test_public_names_are_listed_and_there():
    assert "__version__" in dir(wheelpend) and dir(wheelpend) == sorted(dir(wheelpend))
    for name in dir(wheelpend):
        assert getattr(wheelpend, name) is not None
