"""Sliders of the report: what the page carries of log and model, and how far each parameter may be moved."""

import json
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest

from tests.reports.test_page import explanation  # noqa: F401  # a fixture
from wheelpend.errors import Failure
from wheelpend.model.units import plant_units_of
from wheelpend.reports.page import carried_log, sliders
from wheelpend.reports.page.page import page_html
from wheelpend.reports.page.sliders import Adjustable, slider_section
from wheelpend.reports.page.whole_numbers import held_series, smooth_series, whole_numbers_text


def section_of(ladder):
    section, why = slider_section(Adjustable.of_ladder(ladder), plant_units_of(ladder.model), {})
    assert section and not why
    return section


def whole_numbers(text):
    """Whole numbers of a text, as the page reads them."""
    found, value, place = [], 0, 1
    for byte in b64decode(text):
        value, place = value + (byte & 127) * place, place * 128
        if byte < 128:
            found.append(-(value + 1) // 2 if value % 2 else value // 2)
            value, place = 0, 1
    return np.array(found)


def test_whole_numbers_come_back_as_they_were_and_small_ones_are_one_byte():
    numbers = [0, -1, 1, 63, -64, 64, -65, 8191, -(10**9), 10**12]
    assert whole_numbers(whole_numbers_text(np.array(numbers))).tolist() == numbers
    assert len(b64decode(whole_numbers_text(np.array(numbers[:5])))) == 5 and whole_numbers_text(np.array([])) == ""


def test_the_sum_of_a_command_is_right_to_half_a_quantum_however_long_it_is_and_so_is_what_was_measured():
    values = np.random.default_rng(0).normal(size=5000)
    held, smooth = held_series(values, 0.01), smooth_series(values, 0.01)
    assert np.abs(np.cumsum(whole_numbers(held.whole) * 0.01) - np.cumsum(values)).max() < 0.00501
    assert np.abs(np.cumsum(np.cumsum(whole_numbers(smooth.whole))) * 0.01 - values).max() < 0.00501


def test_an_effect_goes_from_nothing_to_three_times_its_size_and_the_machine_by_half_either_way(explanation):  # noqa: F811
    effect, machine = section_of(explanation).groups
    (torque,) = effect.sliders
    ends = [
        s.value + s.scale * k / sliders.SLIDER_STEPS for s in (torque, machine.sliders[0]) for k in (s.first, s.last)
    ]
    assert ends == pytest.approx([0.0, 3 * torque.value, *(machine.sliders[0].value * np.array([0.5, 1.5]))])
    assert [s.name for s in machine.sliders] == list(explanation.problem.base) and torque.absent == 0.0


def test_everything_that_the_error_is_taken_on_is_carried_and_less_where_it_would_not_fit(explanation, monkeypatch):  # noqa: F811
    whole = section_of(explanation)
    assert whole.whole and whole.error == pytest.approx(explanation.error, rel=1e-9)
    monkeypatch.setattr(carried_log, "MAX_CARRIED_TEXT", len(whole.data) // 3)
    part = section_of(explanation)
    assert not part.whole and 0 < part.seconds < 0.5 * whole.seconds and len(part.data) < 0.5 * len(whole.data)
    assert "as many as fit into the page" in page_html(explanation)


def test_a_value_that_was_not_measured_is_not_counted(explanation):  # noqa: F811
    (validation,) = explanation.problem.data.validation
    begin = int(validation.part.bounds[0, 0])
    measured = validation.part.log.measured.copy()
    measured[begin + 3 : begin + 5, 1] = np.nan
    part = replace(validation.part, log=replace(validation.part.log, measured=measured))
    data = replace(explanation.problem.data, validation=(replace(validation, part=part),))
    lacking = replace(explanation, problem=replace(explanation.problem, data=data))
    runs, freedom = (json.loads(section_of(lacking).data)[n] for n in ("counted", "freedom"))
    assert whole_numbers(runs[1])[:2].tolist() == [3, 2] and len(whole_numbers(runs[0])) == 1
    assert freedom == json.loads(section_of(explanation).data)["freedom"] - 2


@pytest.mark.parametrize("failure", [Failure("X1 must have a value."), NotImplementedError("law: x")])
def test_a_model_that_cannot_be_translated_has_a_sentence_in_place_of_sliders(explanation, monkeypatch, failure):  # noqa: F811
    def refused(*arguments, **options):
        raise failure

    monkeypatch.setattr(sliders, "javascript_page_module", refused)
    page = page_html(explanation)
    said = str(failure) if isinstance(failure, Failure) else "Its equations have a part that cannot be translated"
    assert f"There are no sliders to try other values with: {said}" in page
    assert 'id="try"' not in page and '<script type="module">' not in page


def test_a_prediction_that_runs_away_has_no_sliders(explanation, monkeypatch):  # noqa: F811
    replayed = sliders.replayed_log
    monkeypatch.setattr(
        sliders, "replayed_log", lambda *given: replace(found := replayed(*given), judged=~found.judged)
    )
    section, why = slider_section(Adjustable.of_ladder(explanation), plant_units_of(explanation.model), {})
    assert section is None and "runs away" in why


def test_nothing_in_the_script_ends_its_element(explanation, monkeypatch):  # noqa: F811
    monkeypatch.setattr(sliders, "javascript_page_module", lambda exported: '"</script><!--"')
    assert section_of(explanation).script.startswith('"<\\/script><\\!--"')
