"""The ladder shows both figures, the error and the random force: a step may lower only one."""

import itertools
from types import SimpleNamespace

import pytest

from wheelpend import Model
from wheelpend.reports.ladder import draw_ladder, ladder_rungs
from wheelpend.reports.text.explanation import ladder_lines


def ladder(*forces, plant="slide"):
    steps = [
        SimpleNamespace(effect=f"effect_{k}", error_after=100.0 - k, force_before=before, force_after=after)
        for k, (before, after) in enumerate(itertools.pairwise(forces))
    ]
    problem = SimpleNamespace(plant=Model.default(plant).plant_signature)
    return SimpleNamespace(nominal_error=200.0, base_error=100.0, steps=steps, noise_floor=1.0, problem=problem)


def test_every_rung_but_the_nominal_one_says_what_it_leaves_to_chance(tmp_path):
    found = ladder(0.7, 0.34, 0.012)
    assert [r.force for r in ladder_rungs(found)] == [None, 0.7, 0.34, 0.012]
    lines = list(ladder_lines(found))
    assert "force" not in lines[1] and lines[2].endswith("random force 70 % of the drive")
    assert lines[4].endswith("random force 1.2 % of the drive")
    picture = draw_ladder(found, tmp_path / "ladder.svg").read_text()
    assert "100, force 70 %" in picture and "left to chance" in picture


def test_of_a_machine_that_nothing_drives_it_is_a_share_of_all_that_acts(tmp_path):
    swinging = ladder(0.7, 0.1, plant="pendulum")
    assert list(ladder_lines(swinging))[2].endswith("random force 70 % of what acts on it")
    assert "share of what acts on it" in draw_ladder(swinging, tmp_path / "ladder.svg").read_text()


@pytest.mark.parametrize("forces", [(0.7,), (None, 0.3), (None, None, 0.1)])
def test_no_rung_says_it_where_one_does_not_know(forces, tmp_path):
    assert all(r.force is None for r in ladder_rungs(ladder(*forces)))
    assert "chance" not in draw_ladder(ladder(*forces), tmp_path / "ladder.svg").read_text()
