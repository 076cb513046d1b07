"""Numbers of a comparison and a diagnosis have the units of their plant, and counts their grammar."""

from types import SimpleNamespace

from derive.effects import find, in_plant_units
from wheelpend.diagnosis.replay import ClosedLoopReplay
from wheelpend.model.record import Model
from wheelpend.model.units import plant_units_of
from wheelpend.reports.numbers import quantity_text, unexplained_input_text
from wheelpend.reports.text.comparison import _closed_loop_lines, _error_text, force_error_lines
from wheelpend.reports.text.effect_sizes import detectable_rows

SLIDE, PENDULUM, ROBOT = (Model.default(name) for name in ("slide", "pendulum", "wheel_pendulum"))


def bursts(*at_reversal, peak=0.97321):
    found = [{"log": "a.csv", "from": 3.937, "peak": peak, "at_reversal": r} for r in at_reversal]
    return SimpleNamespace(force_error={"a.csv": 10.7}, bursts=found)


def lines(result, model):
    return " ".join(force_error_lines(result, plant_units_of(model), model.plant_signature.driven))


def test_a_plain_number_has_no_unit_and_no_number_neither():
    assert [quantity_text(0.5, "1"), quantity_text(0.5, "m"), quantity_text(None, "m")] == ["0.5", "0.5 m", "-"]


def test_a_channels_error_is_in_its_unit():
    result = SimpleNamespace(fitted_first=False, error=2.0, noise_floor=1.0, horizon_s=0.5, horizons=(),
                             fit_percent={"x": 99.0}, rmse={"x": 0.004137})  # fmt: skip
    _, table, _ = _error_text(result, plant_units_of(SLIDE))
    assert table.rows == [("x", "99.00", "0.004137 m")]


def test_a_closed_loop_is_off_by_metres_and_volts():
    replay = SimpleNamespace(closed_loop=ClosedLoopReplay({"x": 0.008411}, 283.2, False))
    (said,) = _closed_loop_lines(replay, plant_units_of(SLIDE))
    assert said.endswith("x off by 0.008411 m rms, control input off by 283.2 V rms.")


def test_a_burst_is_as_large_as_its_plant_measures_forces():
    assert "in 1 short stretch the model misses far more force than usual, up to 0.973: at" in lines(
        bursts(False), PENDULUM
    )
    assert "in 2 short stretches the model misses far more force than usual, up to 0.973 V" in lines(
        bursts(False, False), ROBOT
    )


def test_reversals_are_counted_and_refer_to_what_was_said():
    assert "a.csv: the model misses far more force than usual at 1 reversal, where" in lines(bursts(True), SLIDE)
    assert "a.csv: so it does at 2 reversals, where" in lines(bursts(False, True, True), SLIDE)


def test_what_is_unexplained_of_a_machine_that_swings_freely_is_a_share_of_gravity():
    assert "leave 10.7 % of the pull of gravity unexplained" in lines(bursts(), PENDULUM)
    assert "leave 10.7 % of the input unexplained" in lines(bursts(), SLIDE)
    assert "1.2 times as much force as gravity pulls with" in unexplained_input_text(120.0, driven=False)


def test_a_size_that_would_have_shown_has_the_plants_unit():
    for model, text in ((ROBOT, "torque 0.0014 V"), (PENDULUM, "torque 0.0014")):
        plant = model.plant_signature
        problem = SimpleNamespace(effect=lambda name, plant=plant: in_plant_units(find(name), plant))
        found = SimpleNamespace(detectable={"coulomb_drive": {"torque": 0.0014}}, problem=problem)
        assert detectable_rows(found) == [("coulomb_drive", text)]
