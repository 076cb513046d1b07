"""The pages as a site."""

import re
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location

import pytest

from tests.support import ROOT


def configuration():
    spec = spec_from_file_location("docs_configuration", ROOT / "docs" / "conf.py")
    found = module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_every_page_is_in_the_contents_of_the_site():
    listed = [name for names in configuration().CHAPTERS.values() for name in names if not name.startswith("/")]
    assert sorted([*listed, "index"]) == sorted(page.stem for page in (ROOT / "docs").glob("*.md"))


def test_every_page_of_the_site_is_in_the_list_that_readers_of_the_markdown_have():
    linked = re.findall(r"\(([a-z_]+)\.md\)", (ROOT / "docs" / "index.md").read_text(encoding="utf-8"))
    assert {*linked, "index"} == {page.stem for page in (ROOT / "docs").glob("*.md")}


@pytest.mark.slow
@pytest.mark.extras
def test_the_site_is_built_without_a_warning_and_with_every_link_leading_somewhere(tmp_path):
    pytest.importorskip("sphinx")
    pytest.importorskip("myst_parser")
    pytest.importorskip("furo")
    command = [sys.executable, "-P", "-m", "sphinx", "-q", "-W", "--keep-going", "-c", "docs", "-d", tmp_path / "trees"]
    done = subprocess.run([*command, ".", tmp_path / "site"], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    pages = {page.relative_to(tmp_path / "site").with_suffix("") for page in (tmp_path / "site").glob("docs/*.html")}
    assert {str(page) for page in pages} >= {f"docs/{page.stem}" for page in (ROOT / "docs").glob("*.md")}
    reference = (tmp_path / "site" / "docs" / "reference.html").read_text(encoding="utf-8")
    assert "wheelpend.identification.identify.identify" in reference and "Raises Failure" in reference
