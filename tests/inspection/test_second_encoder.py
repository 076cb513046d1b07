"""Against what a second link's angle is measured, by the equations of motion."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import polars as pl
import pytest
from scipy.integrate import solve_ivp

from tests.plants.machines import log_of as machine_log
from tests.plants.machines import model_text
from wheelpend import Log, Model
from wheelpend.inspection.first_look import first_look
from wheelpend.inspection.inspect import inspect_file, inspect_for_model
from wheelpend.model.settings import Setting, with_settings
from wheelpend.view.corrections import setting_words

TEXT = 'plant = "pendulum"\n[assumptions]\nlinks = 2\nsecond_encoder = "{kind}"\n'
RATE_HZ, SPAN_S, NOISE_RAD = 120.0, 8.0, 0.001
KINDS = ("relative", "absolute")


@lru_cache
def swung() -> np.ndarray:
    """Angles (N, 2) against the vertical of two rods that swing freely, by Lagrange's equations and SciPy."""
    mass, length, g, drag = (0.6, 0.22), (0.28, 0.2), 9.81, 2e-4
    centre = [0.5 * l for l in length]
    inertia = [m * l**2 / 12.0 for m, l in zip(mass, length, strict=True)]
    first = inertia[0] + mass[0] * centre[0] ** 2 + mass[1] * length[0] ** 2
    second, shared = inertia[1] + mass[1] * centre[1] ** 2, mass[1] * length[0] * centre[1]
    weights = (mass[0] * centre[0] + mass[1] * length[0]) * g, mass[1] * centre[1] * g

    def rates(_, x):
        apart = x[0] - x[1]
        matrix = [[first, shared * np.cos(apart)], [shared * np.cos(apart), second]]
        forces = [
            -shared * np.sin(apart) * x[3] ** 2 - weights[0] * np.sin(x[0]) - drag * x[2],
            shared * np.sin(apart) * x[2] ** 2 - weights[1] * np.sin(x[1]),
        ]
        return [*x[2:], *np.linalg.solve(matrix, forces)]

    t = np.arange(0.0, SPAN_S, 1.0 / RATE_HZ)
    return solve_ivp(rates, (0.0, SPAN_S), (0.5, -0.6, 0.0, 0.0), "LSODA", t, rtol=1e-9, atol=1e-9).y[:2].T


def log_of(kind: str) -> Log:
    angles = swung().copy()
    if kind == "relative":
        angles[:, 1] -= angles[:, 0]
    angles += NOISE_RAD * np.random.default_rng(2).standard_normal(angles.shape)
    t = np.arange(len(angles)) / RATE_HZ
    return Log("swing", t, np.zeros(t.size), angles, ("theta_1", "theta_2"), rates={})


def kinds_of(model: Model, log: Log) -> list[str]:
    return [f.kind for f in inspect_for_model(model, log).findings if "second_encoder" in f.kind]


@pytest.mark.parametrize("declared", KINDS)
@pytest.mark.parametrize("measured", KINDS)
def test_a_second_link_that_is_measured_otherwise_than_the_model_says_is_told(declared, measured):
    told = kinds_of(Model.parse(TEXT.format(kind=declared)), log_of(measured))
    assert told == ([] if declared == measured else [f"{measured}_second_encoder"])


def test_a_new_model_takes_the_angles_as_they_are_and_one_that_exists_is_set(tmp_path):
    log = log_of("absolute")
    columns = {"t": log.t, "theta_1": log.measured[:, 0], "theta_2": log.measured[:, 1]}
    pl.DataFrame(columns).write_csv(tmp_path / "log.csv")
    assert 'second_encoder = "absolute"' in first_look(tmp_path / "log.csv").model
    model = Model.parse(TEXT.format(kind="relative"))
    (finding,) = (f for f in inspect_file(model, tmp_path / "log.csv")[1].findings if "second" in f.kind)
    assert finding.settings == {"assumptions.second_encoder": "absolute"}
    cured = with_settings(model, [Setting.parse(words) for words in setting_words(finding.settings)])
    assert not [f for f in inspect_file(cured, tmp_path / "log.csv")[1].findings if "second" in f.kind]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "told"), [("two links", ["relative_second_encoder"]), ("two driven links", [])])
def test_a_machine_that_is_as_its_model_says_is_not_accused_and_with_a_motor_nothing_is_told(name, told):
    text, log = model_text(name), machine_log(name)
    assert not kinds_of(Model.parse(text), log)
    other = text.replace("links = 2", 'links = 2\nsecond_encoder = "absolute"')
    assert other != text and kinds_of(Model.parse(other), log) == told


@pytest.mark.parametrize("seed", range(3))
def test_noise_tells_nothing(seed):
    noise = NOISE_RAD * np.random.default_rng(seed).standard_normal(swung().shape)
    still = replace(log_of("absolute"), measured=noise)
    assert not any(kinds_of(Model.parse(TEXT.format(kind=kind)), still) for kind in KINDS)
