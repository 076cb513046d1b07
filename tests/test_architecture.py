"""The house as docs/architecture.md describes it."""

import ast
import re

import pytest

from tests.support import ROOT
from wheelpend.benchmarks.structure import measure

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
PACKAGE = ROOT / "wheelpend"
ROOMS = sorted(path.parent.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("__init__.py"))[1:]


def test_every_room_is_named_on_the_page():
    assert [room for room in ROOMS if "/" not in room and f"`{room}/`" not in PAGE] == []


@pytest.mark.parametrize("room", ROOMS)
def test_a_rooms_front_page_names_its_modules(room):
    modules = [path.stem for path in (PACKAGE / room).glob("*.py") if not path.name.startswith("__")]
    text = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text(encoding="utf-8")))
    assert [name for name in modules if not re.search(rf"\b{name}\b", text)] == []


@pytest.mark.parametrize("room", [r for r in ROOMS if "/" not in r])
def test_a_room_says_what_comes_in_what_goes_out_and_which_question_it_answers(room):
    text = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text(encoding="utf-8")))
    assert all(word in text for word in ("In: ", "Out: ", "Question: "))


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda page: page.stem)
def test_files_that_the_docs_name_are_there(page):
    named = re.findall(
        r"`((?:wheelpend|derive|templates|tests|generated|docs|data)/[\w./-]+\.\w+)`", page.read_text("utf-8")
    )
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_the_structure_is_that_of_the_page():
    found = measure(ROOT)
    assert found.floors <= 14 and found.longest_chain <= 16 and found.arrows <= 254
    assert found.one_word_constants <= 47


def test_a_closed_loop_is_played_in_one_place():
    called = [
        p.relative_to(PACKAGE).as_posix() for p in PACKAGE.rglob("*.py") if ".closed_loop(" in p.read_text("utf-8")
    ]
    assert sorted(called) == [
        "kernels/every_kernel.py",
        "simulation/closed_loop.py",
    ]  # the one compiles, the other plays
