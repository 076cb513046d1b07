"""docs/effects.md: its sections are what the rows of the library make."""

import re

import pytest

from derive import effects_page
from derive.effects import EFFECT_LIBRARY
from derive.files import differences
from derive.parameter_name import full_name
from tests.support import ROOT

PAGE = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8")
MADE = effects_page.page_text(PAGE)


def test_the_page_is_what_the_rows_make():
    stale = differences(ROOT / "docs", {"effects.md": MADE})
    assert not stale, f"docs/effects.md is not what its rows make; run {effects_page.PAGE_COMMAND}\n{stale}"


def test_every_row_has_one_section_and_every_section_a_row():
    assert sorted(re.findall(r"^### (.+)$", PAGE, re.MULTILINE)) == sorted(EFFECT_LIBRARY)


def test_what_is_written_by_hand_stays():
    head, tail = PAGE.partition(effects_page.FIRST_MARK)[0], PAGE.partition(effects_page.LAST_MARK)[2]
    changed = f"{head}{effects_page.FIRST_MARK}anything\n{effects_page.LAST_MARK}{tail}"
    assert effects_page.page_text(changed) == MADE
    assert "# Effects\n" in head and "## What cannot be told apart" in tail


@pytest.mark.parametrize("mark", [effects_page.FIRST_MARK, effects_page.LAST_MARK])
def test_a_page_without_a_mark_is_refused(mark):
    with pytest.raises(ValueError, match="each of these lines once"):
        effects_page.page_text(PAGE.replace(mark, ""))


def test_a_section_states_what_the_row_states():
    text = effects_page.section_text(EFFECT_LIBRARY["stribeck_drive"])
    assert (
        "`sliding` F_c [V], shared, at least 0, not above `static`; `speed` v [rad/s], shared, at least 0.001" in text
    )
    assert "Typical: 0.5, 0.2, 0.5." in text and text.endswith("- Only ever takes energy out.\n")
    assert "quantiles of the log's slip speeds: 0.1, 0.3 and 0.6." in text


def test_letters_of_parameters_stand_in_their_equations():
    strange = [
        full_name(e.name, p.name)
        for e in EFFECT_LIBRARY.values()
        for p in e.parameters
        if not re.search(rf"(?<![a-z]){p.letter or p.name}(?![a-z])", e.equation + e.law_text)
    ]
    assert strange == ["payload_step.time"]  # "from a moment on"


def test_effects_that_a_section_names_are_in_the_library():
    named = {name for e in EFFECT_LIBRARY.values() for name in re.findall(r"`([a-z_]+)`", e.resembles)}
    assert named - set(EFFECT_LIBRARY) == {"ground_friction_reaction"}  # an assumption


def test_the_command_writes_the_page(tmp_path, monkeypatch):
    path = tmp_path / "effects.md"
    path.write_text(f"head\n{effects_page.FIRST_MARK}{effects_page.LAST_MARK}tail\n", encoding="utf-8")
    monkeypatch.setattr(effects_page, "PAGE_PATH", path)
    effects_page.main()
    text = path.read_text(encoding="utf-8")
    assert text.startswith("head\n") and text.endswith("tail\n") and "### viscous_drive\n" in text
    assert list(tmp_path.iterdir()) == [path]
