"""Several models compared on the same logs."""

import json
import re
from dataclasses import replace

import pytest

from tests.support import X, run, simulated
from wheelpend import Failure, Model, compare, save_log

WRONG = {**X, "X5": 0.9 * X["X5"]}


def with_values(values):
    return Model.default().with_fit({n: (v, None) for n, v in values.items()})


@pytest.fixture(scope="module")
def beside():
    log = simulated(duration=4.0)
    return compare(with_values(X), log, against={"wrong": with_values(WRONG), "alike": with_values(X)})


def test_each_model_has_the_errors_that_it_has_alone(beside):
    alone = compare(with_values(WRONG), simulated(duration=4.0))
    wrong, alike = beside.against
    assert (wrong.label, alike.label) == ("wrong", "alike")
    assert wrong.error == alone.error and wrong.rmse == alone.rmse and wrong.fit_percent == alone.fit_percent
    assert wrong.horizons == alone.horizons
    assert alike.error == beside.error < 1.1 < 2.0 < wrong.error


def test_a_row_per_model_and_channel_and_the_errors_in_the_headline(beside):
    frame = beside.to_frame()
    assert frame.columns == ["model", "channel", "fit_percent", "rmse"]
    assert frame["model"].unique(maintain_order=True).to_list() == ["this model", "wrong", "alike"]
    assert f"wrong: {beside.against[0].error:.3g} σ" in repr(beside).splitlines()[0]


def test_all_are_measured_by_the_noise_of_the_first():
    first = with_values(X)
    noisier = Model.parse(first.text + "\n[sensors.noise]\ntheta_p = 0.1\n")
    (other,) = compare(first, simulated(duration=2.0), against=noisier).against
    assert other.error == compare(first, simulated(duration=2.0)).error


def test_models_with_and_without_an_effect_stand_beside_each_other():
    log = simulated(duration=4.0, coulomb_drive__torque=0.3)
    richer = with_values(X).with_effects(["coulomb_drive"]).with_fit({"coulomb_drive.torque": (0.3, None)})
    found = compare(with_values(X), log, against=[richer])
    assert found.error > 5.0 and found.against[0].error == pytest.approx(1.0, abs=0.1)


def test_a_model_without_values_is_fitted_first():
    bare = Model.parse(re.sub(r"\[parameters\][^\[]*", "", Model.default().text))
    (other,) = compare(with_values(WRONG), simulated(duration=2.0), against=bare).against
    assert other.fitted_first and other.error == compare(bare, simulated(duration=2.0)).error


def test_a_held_out_log_is_held_out_for_every_model():
    logs = simulated(duration=4.0), simulated(duration=4.0, seed=1)
    (other,) = compare(with_values(X), logs[0], logs[1], against=with_values(WRONG)).against
    assert other.error == compare(with_values(WRONG), *logs).error > 1.3


def test_other_plants_and_what_is_no_model_are_refused():
    log, model = simulated(duration=2.0), with_values(X)
    with pytest.raises(Failure, match="must be of one plant, but this one is of pendulum, the first of wheel_pendulum"):
        compare(model, log, against={"swing": Model.default("pendulum")})
    with pytest.raises(Failure, match=r"must be a Model, not str. Open it with Model.open\(path\)"):
        compare(model, log, against=["model.toml"])


def test_models_of_one_name_keep_apart():
    model = with_values(X)
    labels = [m.label for m in compare(model, simulated(duration=1.0), against=[model, replace(model)]).models]
    assert len(set(labels)) == 3


def test_the_command_line_shows_a_column_per_model(tmp_path):
    save_log(tmp_path / "log.csv", simulated(duration=4.0))
    for name, values in (("model.toml", X), ("old.toml", WRONG)):
        (tmp_path / name).write_text(with_values(values).text, encoding="utf-8")
    line = ["compare", tmp_path / "log.csv", "--model", tmp_path / "model.toml", "--against", tmp_path / "old.toml"]
    data = json.loads(run(*line, "--json", "-").stdout)
    assert data["against"][0]["model"] == str(tmp_path / "old.toml") and data["against"][0]["error"] > 2.0
    text = run(*line).stdout
    assert "Beside other models" in text and "fit of theta_p" in text
    assert re.search(r"error over 1 s, 4 segments", text) and re.search(r"error over 4 s, 1 segment ", text)
    assert "chance decides which model looks better: judge by the error over 0.5 s." in text
