"""Every language does what the generated kernels do: their functions are run by Python, by C and by JavaScript."""

import itertools
import json
import shutil
import subprocess

import numpy as np
import pytest

import derive
from tests.export.exporting import (
    HERE,
    STRICT,
    interpreted,
    model_with,
    numbers_of_c,
    numbers_of_javascript,
    numbers_of_python,
)
from wheelpend.errors import Failure
from wheelpend.export.c_target import TEMPLATE_FOLDER
from wheelpend.export.exported_model import exported_model
from wheelpend.export.javascript_target import MODULE_FILE, javascript_files
from wheelpend.export.translate.c_code import mathematics_by_name, needed_mathematics
from wheelpend.export.translate.known import RuntimeConstant
from wheelpend.export.translate.program import REAL_NUMBER, Kind
from wheelpend.export.translate.specialise import Specialiser
from wheelpend.kernels.load import model_text
from wheelpend.model.record import Model

needs_gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="needs gcc")
needs_node = pytest.mark.skipif(not shutil.which("node"), reason="needs Node.js")
DOUBLE, SINGLE = 1e-11, 3e-3  # largest difference over 40 samples, relative where a number is above 1

MANY = ("presliding_drive", "actuator_delay", "imu_lag", "winding_inductance", "voltage_dead_zone", "tether_spring")


def difference(numbers, reference):
    assert len(numbers) == len(reference) and np.isfinite(reference).all()
    return np.abs((numbers - reference) / np.maximum(np.abs(reference), 1.0)).max()


@pytest.mark.parametrize(
    "effects", [pytest.param(("coulomb_drive",), id="friction", marks=pytest.mark.slow), pytest.param(MANY, id="many")]
)
@needs_gcc
def test_c_does_what_the_kernels_do(effects, tmp_path):
    exported = exported_model(model_with(*effects))
    reference = numbers_of_python(exported)
    assert difference(numbers_of_c(exported, tmp_path), reference) < DOUBLE
    assert 1e-9 < difference(numbers_of_c(exported, tmp_path, "-DWP_SINGLE"), reference) < SINGLE


@pytest.mark.slow
@needs_gcc
def test_c_touches_nothing_that_is_not_its_own(tmp_path):
    """The sanitizers stay silent over every part."""
    options = ("-g", "-fsanitize=undefined,address", "-fno-sanitize-recover=all")
    exported = exported_model(model_with("coulomb_drive", "actuator_delay", "imu_lag"))
    assert difference(numbers_of_c(exported, tmp_path, *options), numbers_of_python(exported)) < DOUBLE


@pytest.mark.parametrize(
    "effects", [pytest.param(("coulomb_drive",), id="friction", marks=pytest.mark.slow), pytest.param(MANY, id="many")]
)
@needs_node
def test_javascript_does_what_the_kernels_do(effects, tmp_path):
    exported = exported_model(model_with(*effects))
    assert difference(numbers_of_javascript(exported, tmp_path), numbers_of_python(exported)) < DOUBLE


def every_effect():
    for plant in ("wheel_pendulum", "pendulum", "cart_pole", "slide"):
        for row in derive.effects.applicable_to(Model.default(plant).plant_signature):
            yield pytest.param(plant, row.name, id=f"{plant}-{row.name}")


@pytest.mark.slow
@pytest.mark.parametrize(("plant", "effect"), list(every_effect()))
@needs_gcc
@needs_node
def test_every_effect_of_the_library_is_exported_in_every_language(plant, effect, tmp_path):
    try:
        exported = exported_model(model_with(effect, plant=plant))
    except Failure as failure:
        pytest.skip(str(failure))
    reference = numbers_of_python(exported)
    assert difference(numbers_of_c(exported, tmp_path), reference) < 1e-10
    assert difference(numbers_of_javascript(exported, tmp_path), reference) < 1e-10
    numbers_of_c(exported, tmp_path, "-DWP_SINGLE")  # no warning of a number that no float holds
    if shutil.which("clang"):
        numbers_of_c(exported, tmp_path, compiler="clang")


@needs_gcc
@pytest.mark.parametrize(("function", "low", "high"), [
    ("sin", -1e4, 1e4), ("cos", -1e4, 1e4), ("exp", -600.0, 600.0), ("log", 1e-300, 1e300), ("tanh", -30.0, 30.0),
    ("atan", -1e3, 1e3), ("erfc", -5.0, 20.0), ("sqrt", 0.0, 1e6), ("tan", -1.5, 1.5),
])  # fmt: skip
def test_its_mathematics_is_right_to_the_last_digits(function, low, high, tmp_path):
    points = np.r_[np.linspace(low, high, 2001), np.geomspace(max(low, 1e-12), high, 500)]
    program = "\n".join([
        "#include <float.h>", "#include <stdbool.h>", "#include <stdio.h>", "#include <math.h>",
        (TEMPLATE_FOLDER / "precision.h").read_text(), (TEMPLATE_FOLDER / "limits.h").read_text(),
        "typedef struct { wp_real v[2]; } wp_reals2;", needed_mathematics({function}),
        "int main(void) { double x; while (scanf(\"%lf\", &x) == 1) printf(\"%.17g %.17g\\n\", "
        f"wp_{function}(x), {function}(x)); return 0; }}",
    ])  # fmt: skip
    (tmp_path / "program.c").write_text(program)
    subprocess.run(["gcc", *STRICT, tmp_path / "program.c", "-o", tmp_path / "program", "-lm"], check=True)
    given = "\n".join(map(repr, points.tolist()))
    done = subprocess.run([tmp_path / "program"], input=given, capture_output=True, text=True, check=True)
    ours, theirs = np.array(done.stdout.split(), dtype=float).reshape(-1, 2).T
    scale = np.maximum(np.abs(theirs), 1.0) if function in ("sin", "cos") else np.maximum(np.abs(theirs), 1e-300)
    assert np.max(np.abs(ours - theirs) / scale) < (2e-13 if function == "erfc" else 4e-15)


def test_all_mathematics_is_found_by_name():
    assert set(mathematics_by_name()) >= {"sin", "exp", "erfc", "power", "whole", "min_int", "isnan"}


# -- the kernels for loops in real time against those for whole logs


@pytest.mark.parametrize("effects", [(), ("coulomb_drive",), ("imu_lag",)], ids=["plain", "friction", "late sensors"])
def test_a_machine_sample_by_sample_moves_as_one_in_a_whole_log(effects):
    exported = exported_model(model_with(*effects), period=0.004)
    whole = interpreted(model_text(exported.model.plant, exported.model.assumptions, effects))
    one = interpreted(exported.text)
    count = 60
    t = np.arange(count) * exported.period
    parameters = exported.parameters[: whole.NP] if whole.NP < exported.module.NP else exported.parameters
    order = [exported.module.PARAMETERS.index(n) for n in whole.PARAMETERS]
    parameters = exported.parameters[order]
    start = np.zeros(4)
    angle = 0.05 * np.sin(9.0 * t)
    states, measured, voltage = whole.closed_loop(
        t, angle, np.gradient(angle, t), np.array(exported.model.controller.gains), start, parameters,
        np.zeros((count, 3)), np.zeros(3), exported.max_step,
    )  # fmt: skip
    own = [exported.parameters.copy(), np.zeros(exported.size), np.zeros(exported.commands),
           np.zeros((exported.late_readings, 3))]  # fmt: skip
    one.start_machine(start, voltage[0], *own)
    output, moved, read = np.zeros(3), [own[1][:4].copy()], []
    for k in range(count - 1):
        one.step_machine(t[k], exported.period, voltage[k], own[0], exported.max_step, *own[1:], output)
        moved.append(own[1][:4].copy())
        read.append(output.copy())
    assert np.abs(states).max() > 0.01
    np.testing.assert_allclose(moved, states, atol=1e-8 if effects == ("imu_lag",) else 1e-13)
    np.testing.assert_allclose(read[15:], measured[16:], atol=1e-8)


@pytest.mark.parametrize("effects", [(), ("coulomb_drive",)], ids=["plain", "friction"])
def test_the_observer_is_the_filter_of_identify(effects):
    exported = exported_model(model_with(*effects))
    model = exported.model
    whole = interpreted(model_text(model.plant, model.assumptions, effects, missing_force=True))
    one = interpreted(exported.text)
    random, count, size = np.random.default_rng(1), 50, exported.size + len(exported.sources)
    t, voltage = np.arange(count) * exported.period, 0.5 * np.sin(0.4 * np.arange(count))
    measured = random.normal(size=(count, 3)) * exported.readings_sigma
    means, covariances = np.zeros((3 * count, 2, size)), np.zeros((3 * count, 2, size, size))
    innovation = np.zeros((count, 3, 2))
    whole.filter_error(
        t, voltage, measured, 1.0 / exported.readings_sigma, np.array([[0, count]]), np.zeros((1, 4)), exported.spread,
        exported.parameters.copy(), np.zeros(0, np.int64), exported.forces, exported.mixing, exported.reads,
        exported.noise, exported.max_step, 1, np.zeros((1, 1, 1)), np.zeros(1), innovation, means, covariances,
        np.zeros((3 * count, size, size)), np.zeros(3 * count, np.int64),
    )  # fmt: skip
    count_sources, none = len(exported.sources), np.zeros(0, np.int64)
    parameters, now, commands = exported.parameters.copy(), np.zeros(exported.size), np.zeros(exported.commands)
    moving = [np.zeros((exported.size, exported.size + 2)), np.zeros(count_sources), np.zeros((count_sources, 0)),
              np.zeros((size, size))]  # fmt: skip
    rubbing, found = np.zeros(one.SURFACES), np.zeros(3)
    one.start_filter(np.zeros(4), exported.spread, voltage[0], parameters, exported.reads, exported.noise, now,
                     commands, *moving, rubbing)  # fmt: skip
    for k in range(count):
        one.filter_readings(t[k], measured[k], 1.0 / exported.readings_sigma, parameters, none, exported.reads, now,
                            *moving, np.zeros((0, 0)), np.zeros(0), found,
                            np.zeros(3), np.zeros(3))  # fmt: skip
        np.testing.assert_allclose(np.r_[now, moving[1]], means[k, 1], atol=1e-12)
        np.testing.assert_allclose(found, innovation[k, :, 0], atol=1e-9)
        one.filter_step(t[k], exported.period, voltage[k], parameters, none, exported.forces, exported.mixing,
                        exported.reads, exported.noise, exported.max_step, now, commands, *moving, rubbing)  # fmt: skip


# -- the translation itself


def translated(text, **constants):
    made = Specialiser(text, {"RATE": RuntimeConstant("WP_RATE"), **constants})
    return made.add("kernel", {"x": REAL_NUMBER, "a": Kind("array", (3,)), "n": REAL_NUMBER}, "kernel")


def test_a_loop_in_steps_and_a_swap_of_two_values_keep_their_meaning():
    text = "def kernel(x, a):\n    for i in range(0, 3, 2):\n        a[i], x = x, a[i]\n    return x\n"
    function = translated(text)
    assert function.body[0].step == 2 and function.written == {"a"}
    assert [type(s).__name__ for s in function.body[0].body] == ["Assign"] * 4  # both values are taken first


def test_what_is_known_beforehand_is_folded_and_what_nobody_reads_left_out():
    text = "def kernel(x, a):\n    idle = a[0] * 2.0\n    if SIZE > 1:\n        return x\n    return a[1]\n"
    (statement,) = translated(text, SIZE=2).body
    assert statement.value.name == "x"


@pytest.mark.parametrize("line", ["x = open('file')", "import os", "x = [v for v in a]", "x = a @ a", "del x"])
def test_what_is_no_language_of_the_templates_is_refused(line):
    with pytest.raises(NotImplementedError):
        translated(f"def kernel(x, a):\n    {line}\n    return x\n")


def test_no_two_parts_of_an_export_have_functions_of_one_name():
    names = [f.name for f in exported_model(model_with("coulomb_drive")).program().functions]
    assert len(names) == len(set(names)) and all(a != b for a, b in itertools.pairwise(sorted(names)))


@pytest.fixture(scope="module")
def hazards(tmp_path_factory):
    """What hazards.mjs prints, by the filter."""
    module = tmp_path_factory.mktemp("hazards") / MODULE_FILE
    module.write_text(javascript_files(exported_model(model_with("coulomb_drive")))[MODULE_FILE])
    command = ["node", f"{HERE}/hazards.mjs", module.as_uri()]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout)


@needs_node
@pytest.mark.parametrize("part", ["observer", "identifier"])
def test_a_reading_that_is_none_or_far_off_is_refused_in_javascript(hazards, part):
    seen = hazards[part]
    assert [seen[name]["taken"] for name in ("none", "infinite", "glitch")] == [[0, 1, 1], [1, 0, 1], [1, 1, 0]]
    for name in ("plain", "none", "infinite", "glitch", "after"):
        assert seen[name]["off"] < 0.01 and seen[name]["healthy"]


@needs_node
@pytest.mark.parametrize("part", ["observer", "identifier"])
def test_a_filter_in_javascript_that_is_wrong_itself_believes_its_sensors_again(hazards, part):
    seen = hazards[part]
    assert seen["lost"]["taken"][0] == 0 and not seen["lost"]["healthy"]
    assert seen["believed"]["taken"][0] == 1 and seen["believed"]["off"] < 0.02
    assert seen["settled"]["off"] < 0.01 and seen["settled"]["healthy"]
    assert not seen["sick"]["healthy"]
    assert seen["anew"]["off"] < 0.01 and seen["anew"]["healthy"]
