"""What no effect explains: it is located, its repeatable part measured, and a law offered for it."""

from dataclasses import replace

import numpy as np
import pytest

from derive import plants
from tests.support import simulated
from wheelpend import Failure, Model, simulate
from wheelpend.diagnosis.evidence import ValidatedFit
from wheelpend.diagnosis.likelihood.resonance import Resonance
from wheelpend.diagnosis.missing_force.estimate import _log_marginal_likelihood
from wheelpend.diagnosis.missing_force.law_search import find_law
from wheelpend.diagnosis.missing_force.law_terms import CoveredRange, coefficient_unit, term_library
from wheelpend.diagnosis.missing_force.repeatability import ExplainedForce, explained_forces
from wheelpend.diagnosis.score_test import ScoreTest
from wheelpend.diagnosis.verdict import conclude, with_repeating_force
from wheelpend.estimation.continuation import fit_model
from wheelpend.estimation.data import prepare
from wheelpend.estimation.free_parameters import free_names
from wheelpend.estimation.scaled_inverse import positive_semidefinite
from wheelpend.estimation.starts import best_start
from wheelpend.identification.remainder import Remainder
from wheelpend.kernels.load import free_force_module
from wheelpend.model import model_kernels
from wheelpend.model.units import plant_units_of
from wheelpend.model.user_effects import effects_from_text, read_user_effects, write_user_effects
from wheelpend.reports.page.force_figures import most_repeatable_figure
from wheelpend.reports.page.rows import law_table
from wheelpend.reports.text.unexplained import repeatability_sentences
from wheelpend.serialise import to_json

PLANT = plants.build("wheel_pendulum", plants.complete_assumptions("wheel_pendulum", {})).plant_signature
CUBIC = """# what the bearing does
[cubic_drag]
family = "body"
sentence = "A drag on the body that grows with the cube of its rate."
on = "body"
law = "c*dtheta_p^3"
parameters.c = { unit = "V s³/rad³", typical = 1.0 }
"""


def fitted(log, model=None):
    problem, start = best_start(prepare(model or Model.default(), [log]))
    return problem, fit_model(problem, start, free_names(problem, problem.model.effects))


def pushed_at_random(seed, correlated):
    """A log whose robot was pushed by a random force that no state predicts."""
    log = simulated(seed=seed, duration=12.0)
    random, keep = np.random.default_rng(seed), np.exp(-log.dt / correlated)
    push = np.zeros(len(log.t))
    for k, step in enumerate(random.normal(size=len(push) - 1)):
        push[k + 1] = keep * push[k] + np.sqrt(1 - keep**2) * step
    return replace(log, voltage=log.voltage + 0.5 * push)


@pytest.mark.parametrize("correlated", [0.02, 0.3])
def test_a_random_force_does_not_repeat(correlated):
    for found in explained_forces(*fitted(pushed_at_random(2, correlated))):
        assert found.repeatable < 0.05
        assert found.depends_on == ()


def test_where_only_noise_is_left_nothing_is_missing_that_could_repeat():
    assert explained_forces(*fitted(simulated(seed=3, duration=9.0))) == ()


@pytest.fixture(scope="module")
def dry():
    """A diagnosis of dry friction by a library without effects."""
    problem, base = fitted(simulated(seed=4, duration=9.0, coulomb_drive__torque=0.3))
    return with_repeating_force(conclude(problem, ValidatedFit.of(problem, base), [], ScoreTest((), {})))


def test_dry_friction_in_the_drive_repeats_with_the_slip_and_jumps_at_zero(dry):
    found = dry.repeats[0]
    assert (found.row, found.depends_on[0]) == ("drive", "dtheta_w - dtheta_p")
    assert found.repeatable > 0.95
    curve = found.curves[0]
    before, after = curve.force[curve.x < -0.2][-1], curve.force[curve.x > 0.2][0]
    assert after - before == pytest.approx(0.6, abs=0.1)
    assert np.all(curve.sigma > 0.0) and np.all(curve.sigma < 0.3)
    assert most_repeatable_figure((found,), plant_units_of(Model.default())) is not None
    assert repeatability_sentences((found,))[0].startswith("99 % of the missing force repeats with dtheta_w")


def test_nothing_repeats_is_not_said_beside_what_was_found_to_repeat():
    nothing = (ExplainedForce("wheel", (), 0.0, 0.0),)
    assert "Nothing of the missing force repeats" in repeatability_sentences(nothing, Remainder())[0]
    ringing = Remainder(resonances=(Resonance("theta_w", 5.0, 0.1, 0.3, 1e-6),))
    assert ringing.what_repeats and not repeatability_sentences(nothing, ringing)


@pytest.fixture(scope="module")
def cubic(tmp_path_factory):
    """A log of a robot with a drag that the library does not have, and the law found for it without it."""
    folder = tmp_path_factory.mktemp("robot")
    (folder / "effects.toml").write_text(CUBIC, encoding="utf-8")
    own = Model.default().save(folder)
    with pytest.MonkeyPatch.context() as patch:  # fewer kernels to compile than the whole library with the effect
        patch.setattr(
            model_kernels,
            "library_module",
            lambda plant, assumptions, own=(), released=(): free_force_module(plant, assumptions, own),
        )
        log = simulate(own, hide={"cubic_drag.c": 3.0}, seed=1, duration=9.0, sample=0.002)
    return own, find_law(*fitted(log))


@pytest.mark.slow
def test_a_law_that_the_library_lacks_is_found_and_predicts_at_the_noise(cubic):
    _, law = cubic
    assert (law.laws, law.on) == ({"free_law": "size_1*dtheta_p^3"}, {"free_law": "body"})
    size, sigma = law.coefficients["free_law.size_1"], law.sigma["free_law.size_1"]
    assert abs(size - 3.0) < 4 * sigma < 0.1
    assert law.unit["free_law.size_1"] == "V s³/rad³"
    assert law.error_before > 5.0
    assert law.error_after < 1.05 * law.noise_floor
    assert law.explains > 0.99
    assert law_table(law).laws == [("free_law", "body", "size_1·θ̇p³")]


def test_an_accepted_law_is_a_row_of_effects_toml_and_comments_stay(cubic):
    model, law = cubic
    path = write_user_effects(model.workspace, law.with_name("stiff_bearing").tables(), PLANT)
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# what the bearing does\n[cubic_drag]")
    names = [row.name for row in read_user_effects(model.workspace, PLANT)]
    assert names == ["cubic_drag", "stiff_bearing"]
    with pytest.raises(Failure, match=r"stiff_bearing is in .*effects\.toml already"):
        write_user_effects(model.workspace, law.with_name("stiff_bearing").tables(), PLANT)
    assert path.read_text(encoding="utf-8") == text


@pytest.mark.parametrize("name", ["coulomb_drive", "Big", "missing_thing", "x y"])
def test_a_law_is_not_accepted_under_a_name_that_cannot_be(cubic, name, tmp_path):
    with pytest.raises(Failure, match="name"):
        write_user_effects(tmp_path, cubic[1].with_name(name).tables(), PLANT)
    assert not list(tmp_path.iterdir())


def test_every_term_is_a_law_of_the_grammar_and_its_unit_makes_it_a_force():
    covered = CoveredRange({}, {}, {"dtheta_w - dtheta_p": (1.0,), "dtheta_w": (1.0,), "dtheta_p": (1.0,)})
    found = term_library(PLANT, covered)
    for number, term in enumerate(found):
        sizes = "".join(f"\nparameters.{n} = {{ unit = '{u}', typical = 0.1 }}" for n, u in term.sizes)
        shapes = "".join(f"\nparameters.{s.name} = {{ unit = '{s.unit}', typical = {s.value}, starts = [{s.value}] }}"
                         for s in term.shapes)  # fmt: skip
        head = f"[t{number}]\nfamily = 'body'\nsentence = ''\non = '{term.port}'\nlaw = '{term.text}'"
        assert effects_from_text(head + sizes + shapes, PLANT)
    assert len(found) > 80
    assert coefficient_unit({"rad": 3, "s": -3}) == "V s³/rad³"
    assert coefficient_unit({"V": 1}) == "1"
    assert coefficient_unit({"rad": 1, "s": 1}) == "V/(s rad)"


def test_a_diagnosis_that_explains_nothing_says_where_and_what_repeats(dry):
    assert dry.verdict == "unexplained"
    assert dry.where
    assert to_json(dry)["missing"][0]["row"] == "drive"


def test_rounding_below_zero_in_the_information_of_a_quiet_sensor_is_no_crash():
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(3, 4, 10)) * 1e9
    exact = np.swapaxes(rows, 1, 2) @ rows  # of rank 4: six directions are known to rounding alone
    broken = exact - 1e-9 * np.einsum("sii->s", exact)[:, None, None] * np.eye(10)
    assert (np.linalg.eigvalsh(broken) < -1.0).any()
    mended = positive_semidefinite(np.concatenate([broken, np.full((1, 10, 10), np.nan)]))
    assert np.allclose(mended[:3], exact, atol=1e-8 * exact.max()) and not mended[3].any()
    for information in mended:
        assert np.isfinite(_log_marginal_likelihood(information, np.ones(10), np.ones(1)))


def test_information_without_rounding_stays_as_it_is():
    rows = np.random.default_rng(1).normal(size=(2, 20, 5))
    information = np.swapaxes(rows, 1, 2) @ rows
    assert np.array_equal(positive_semidefinite(information), information)
