"""The title of a report says in words what was found and what it does to the error."""

from types import SimpleNamespace

import pytest

from wheelpend.estimation.estimate import Estimate, LogValue
from wheelpend.model.record import Model
from wheelpend.reports.text.title import title_text

PLANTS = {name: Model.default(name).plant_signature for name in ("wheel_pendulum", "slide")}
DRY = ("coulomb_drive", {"torque": Estimate(0.30002, 0.0001, unit="V")}, ())
RIPPLE = ("cogging", {n: Estimate(0.1, 0.01, unit="V") for n in ("sine", "cosine")}, ())
OFFSET = ("com_offset", {"angle": Estimate(0.02, 0.001, unit="rad")}, ("imu_bias",))
LATE = ("actuator_delay", {"delay": Estimate(0.004, 1e-5, unit="s")}, ())


def title(
    *steps, before=52.4, after=0.997, floor=0.9989, verdict="nothing_missing", plant="wheel_pendulum", has=None,
    forces=(None, None), instead=(), determines_nothing=False,
):  # fmt: skip
    made = tuple(
        SimpleNamespace(effect=e, estimates=found, equivalent_to=alike, force_before=forces[0], force_after=forces[1])
        for e, found, alike in steps
    )
    problem = SimpleNamespace(plant=PLANTS[plant])
    values = has or {}
    known = list(dict.fromkeys(n.partition(".")[0] for n in values))
    left = SimpleNamespace(instead=instead)
    return title_text(SimpleNamespace(steps=made, parameters=values, base_error=before, error=after, noise_floor=floor,
                                      verdict=verdict, problem=problem, effects=known, remainder=left,
                                      last=SimpleNamespace(determines_nothing=determines_nothing)))  # fmt: skip


def test_where_the_logs_determine_nothing_the_title_names_nothing():
    assert title(verdict="unexplained", determines_nothing=True).startswith("What is missing cannot be told")
    assert title(verdict="unexplained") == "Something is missing that the library does not hold"


def test_where_a_law_would_do_as_well_as_chance_the_title_does_not_say_that_nothing_is_missing():
    laws = ("viscous_drive", "quadratic_drive")
    assert (
        title(instead=laws) == "What remains may be chance or viscous_drive or quadratic_drive: these logs do not tell"
    )
    has = {"coulomb_drive.torque": Estimate(0.3, 0.01, unit="V")}
    assert title(instead=laws[:1], has=has) == (
        "What remains beside dry friction in motor and gearbox (coulomb_drive), 0.3 V may be chance or viscous_drive: "
        "these logs do not tell"
    )


def test_one_effect_has_its_sentence_its_name_and_its_size():
    assert title(DRY) == (
        "Dry friction in motor and gearbox (coulomb_drive), 0.3 V: that explains the error down to the noise, "
        "52.4 → 0.997 σ"
    )


def test_several_effects_stand_in_a_row_and_one_that_needs_several_numbers_has_none():
    assert title(DRY, LATE, RIPPLE).startswith(
        "Dry friction in motor and gearbox (coulomb_drive), 0.3 V; the commanded voltage acts later than logged "
        "(actuator_delay), 0.004 s; torque ripple of the motor or a gear, repeating over a turn of the drive "
        "(cogging): together they explain"
    )


def test_what_the_data_cannot_tell_apart_is_named_beside_it():
    assert "pitch is measured (com_offset or imu_bias), 0.02 rad: that" in title(OFFSET, verdict="ambiguous")


@pytest.mark.parametrize(
    ("before", "after", "verdict", "words"),
    [
        (50.0, 5.0, "nothing_missing", "that explains most of the error, 50.0 → 5.00 σ"),
        (50.0, 40.0, "nothing_missing", "that explains a part of the error, 50.0 → 40.0 σ"),
        (50.0, 40.0, "unexplained", "a part of the error, and something is still missing, 50.0 → 40.0 σ"),
        (5.0, 5.1, "nothing_missing", "that explains forces that a larger error hides, 5.00 → 5.10 σ"),
        (float("inf"), 9.0, "nothing_missing", "that explains most of the error, – → 9.00 σ"),
    ],
)
def test_no_more_is_claimed_than_the_error_shows(before, after, verdict, words):
    assert title(DRY, before=before, after=after, verdict=verdict).endswith(words)


@pytest.mark.parametrize(
    ("after", "forces", "words"),
    [
        (1.51, (3.8, 0.024), "that explains most of what was left to chance, 380 % → 2.4 % of the drive"),
        (1.51, (0.1, 0.08), "that explains forces that a larger error hides, 1.45 → 1.51 σ"),
        (1.2, (3.8, 0.024), "that explains most of the error, 1.45 → 1.20 σ"),
        (1.51, (float("inf"), 0.024), "that explains forces that a larger error hides, 1.45 → 1.51 σ"),
    ],
)
def test_where_the_random_force_falls_and_not_the_error_that_is_what_is_explained(after, forces, words):
    assert title(DRY, before=1.45, after=after, forces=forces).endswith(words)


def test_a_size_that_each_log_has_for_itself_is_not_the_first_logs():
    own = (LogValue("a.csv", 0.1, 0.01), LogValue("b.csv", 0.2, 0.01))
    slope = ("slope", {"angle": Estimate(0.1, 0.01, unit="rad", per_log=own)}, ())
    assert "(slope): that explains" in title(slope)


def test_the_words_are_those_of_the_plant():
    assert "Drag of the air on the moving" in title(("air_drag", DRY[1], ()))
    assert "robot" not in title(("tether_spring", DRY[1], ()), plant="slide")


def test_without_a_step_the_title_is_the_verdict():
    assert title() == "Nothing is missing in this model"
    assert title(verdict="unexplained") == "Something is missing that the library does not hold"


def test_without_a_step_the_title_says_what_the_model_already_has():
    added = {"coulomb_drive.torque": DRY[1]["torque"]}
    dry = "Dry friction in motor and gearbox (coulomb_drive), 0.3 V"
    assert title(has=added) == f"Nothing more is missing in this model: {dry}"
    ripple = {f"cogging.{n}": e for n, e in RIPPLE[1].items()}
    assert title(has=added | ripple).startswith(f"Nothing more is missing in this model: {dry}; ")
    assert title(has=added, verdict="unexplained") == "Something is missing that the library does not hold"
