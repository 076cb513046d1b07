"""FMUs under FMPy: valid, and moving as the model does, whether their own steps or FMPy's solver move them."""

import ctypes
import io
import re
import shutil
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.export.exporting import COMMANDS, HERE, STRICT, interpreted, model_with
from tests.export.fmus import (
    OTHER_MACHINES,
    Instance,
    compiled_strictly,
    exported_with,
    fmu_paths,
    kernels_start,
    start_values,
    stepped,
)
from tests.export.test_languages import every_effect, needs_gcc
from tests.pages import blocks
from tests.support import ROOT, run, simulated
from wheelpend.errors import Failure
from wheelpend.export.export import export_model
from wheelpend.export.fmu_target import fmu_carried, fmu_content, fmu_files, fmu_notes, fmu_sources
from wheelpend.export.fmu_units import fmi_unit
from wheelpend.export.fmu_variables import fmu_variables, per_second, structured
from wheelpend.kernels.load import model_text
from wheelpend.model import workspace

MANY = ("presliding_drive", "actuator_delay", "imu_lag", "winding_inductance", "voltage_dead_zone", "tether_spring")
ROBOT = "wheel_pendulum"
under_fmpy = [pytest.mark.extras, needs_gcc]
VERSIONS = [pytest.param(2, marks=pytest.mark.slow), 3]  # the newer one every time


@pytest.fixture
def fmpy():
    return pytest.importorskip("fmpy")


def marked(test):
    for mark in under_fmpy:
        test = mark(test)
    return test


def in_kernels(exported, count=len(COMMANDS)):
    """Readings (count + 1, NY) of the interpreted kernels under the commands, and the start as start values."""
    e, state = exported, np.zeros(exported.module.NX)
    state[0], state[-1] = 0.01, 0.05
    given = (lambda u: u) if e.inputs <= 1 else (lambda u: np.full(e.inputs, u))
    kernels, arrays = kernels_start(e, state, given)
    values, output = start_values(e, arrays[0], arrays[1]), np.zeros(e.module.NY)
    kernels.read_sensors(0.0, arrays[1], arrays[0], output)
    read = [output.copy()]
    for k in range(count):
        kernels.step_machine(k * e.period, e.period, given(COMMANDS[k]), arrays[0], e.max_step, *arrays[1:], output)
        read.append(output.copy())
    return np.array(read), values


def in_co_simulation(plant, effects, version, values, steps):
    """The same of an FMU, over steps of so many periods each."""
    e = exported_with(plant, effects)
    outputs, inputs = e.module.OUTPUTS, e.module.INPUTS[: e.inputs]
    instance = Instance(plant, effects, version).begin(values)
    read, done = [instance.get(*outputs)], 0
    for periods in steps:
        instance.set(dict.fromkeys(inputs, COMMANDS[done]))
        instance.fmu.doStep(done * e.period, periods * e.period)
        done += periods
        read.append(instance.get(*outputs))
    instance.close()
    return np.array(read)


@marked
@pytest.mark.parametrize("effects", [(), MANY], ids=["plain", "many"])
@pytest.mark.parametrize("version", VERSIONS)
def test_an_fmu_is_valid_and_its_steps_are_those_of_the_kernels(fmpy, version, effects):
    from fmpy.validation import validate_fmu

    assert validate_fmu(fmu_paths(ROBOT, effects)[version]) == []
    reference, values = in_kernels(exported_with(ROBOT, effects))
    found = in_co_simulation(ROBOT, effects, version, values, [1] * len(COMMANDS))
    np.testing.assert_allclose(found, reference, atol=1e-12)


@marked
def test_a_step_of_several_periods_holds_its_command(fmpy):
    effects = ("coulomb_drive", "actuator_delay")
    reference, values = in_kernels(exported_with(ROBOT, effects), 1)
    held = Instance(ROBOT, effects, 2).begin(values)
    single = Instance(ROBOT, effects, 2).begin(values)  # two instances of one process do not know of each other
    held.set({"v_in": 0.7})
    held.fmu.doStep(0.0, 0.004)
    for k in range(4):
        single.set({"v_in": 0.7})
        single.fmu.doStep(0.001 * k, 0.001)
    np.testing.assert_allclose(held.get("theta_w", "dtheta_p"), single.get("theta_w", "dtheta_p"), rtol=1e-12)
    assert abs(held.get("theta_w")[0] - reference[0, 0]) > 1e-9
    held.close(), single.close()


def stepped_with(effects, lengths, start):
    """Readings at the end of 30 ms under an input that changes every 5 ms, by steps of these lengths in turn [s]."""
    instance, time, place = Instance(ROBOT, effects, 2).begin(start), 0.0, 0
    while time < 0.03 - 1e-9:
        until = 0.005 * (int(time / 0.005 + 1e-9) + 1)
        length = min(lengths[place % len(lengths)], until - time)
        instance.set({"v_in": 0.8 * np.sin(100.0 * until)})
        instance.fmu.doStep(time, length)
        time, place = time + length, place + 1
    read = instance.get("theta_w", "theta_p", "dtheta_p")
    instance.close()
    return read


@marked
@pytest.mark.parametrize("effects", [
    ("actuator_delay", "imu_lag"), *(pytest.param((n,), marks=pytest.mark.slow) for n in ("actuator_delay", "imu_lag")),
], ids="+".join)  # fmt: skip
def test_steps_of_any_length_keep_delays_of_input_and_sensors(fmpy, effects):
    """Steps that are short beside the delay, long beside it, or change all the time come to what steps of 0.1 ms do."""
    start = {"state.theta_p": 0.05, **{f"{e}.delay": 0.0073 for e in effects}}
    fine = stepped_with(effects, [1e-4], start)
    undelayed = stepped_with(effects, [1e-4], start | {f"{e}.delay": 0.0 for e in effects})
    apart = np.abs(fine - undelayed)[1:].max()
    for lengths, share in (([1e-3], 1e-6), ([2e-5], 1e-5), ([5e-3], 1e-6), ([7e-4, 1e-4, 1.3e-3, 2e-5], 1e-3)):
        assert np.abs(stepped_with(effects, lengths, start) - fine)[1:].max() < share * apart, lengths


@marked
@pytest.mark.parametrize("version", VERSIONS)
def test_fmpys_solver_finds_what_an_independent_one_finds(fmpy, version):
    """CVode on the FMU against DOP853 on the accelerations of the module for whole logs, under a held input."""
    exported = exported_with(ROBOT, ())
    whole = interpreted(model_text(ROBOT, exported.model.assumptions, ()))
    parameters = exported.parameters[[exported.module.PARAMETERS.index(n) for n in whole.PARAMETERS]]
    times = np.linspace(0.0, 0.5, 6)
    commands = 0.6 * np.sin(9.0 * times)
    state = np.array([0.0, 0.02, 0.0, 0.0])
    for k in range(5):
        solved = solve_ivp(
            lambda t, x, u=commands[k]: np.r_[x[2:], whole.acceleration(t, x, u, parameters)],
            times[k : k + 2], state, "DOP853", rtol=1e-12, atol=1e-13,
        )  # fmt: skip
        state = solved.y[:, -1]
    found = fmpy.simulate_fmu(
        fmu_paths(ROBOT, ())[version], fmi_type="ModelExchange", stop_time=0.5, relative_tolerance=1e-9,
        start_values={"state.theta_p": 0.02}, input=stepped(times, commands), output_interval=0.1,
    )[-1]  # fmt: skip
    assert abs(state).min() > 1e-3
    np.testing.assert_allclose([found[n] for n in ("theta_w", "theta_p", "dtheta_p")], state[[0, 1, 3]], atol=1e-6)


def both_ways(fmpy, effects, version, start, duration=0.6, amplitude=0.6):
    """Readings in model exchange, by CVode, and in co-simulation; modes of the surfaces in the former."""
    directions = [v.name for v in fmu_variables(exported_with(ROBOT, effects)).directions]
    times = np.arange(0.0, duration + 1e-9, 0.05)
    given = {
        "start_values": start, "stop_time": duration, "output_interval": 0.01, "record_events": False,
        "input": stepped(times, amplitude * np.sin(9.0 * times)),
        "output": ["theta_w", "theta_p", "dtheta_p", *directions],
    }  # fmt: skip
    path = fmu_paths(ROBOT, effects)[version]
    ways = [fmpy.simulate_fmu(path, fmi_type=kind, relative_tolerance=1e-10, **given)
            for kind in ("ModelExchange", "CoSimulation")]  # fmt: skip
    readings = [np.array([way[n] for n in ("theta_w", "theta_p", "dtheta_p")]) for way in ways]
    return *readings, {n: set(ways[0][n]) for n in directions}


@marked
@pytest.mark.parametrize(("effects", "version"), [
    pytest.param(("coulomb_drive",), 2, id="drive, 2", marks=pytest.mark.slow),
    pytest.param(("coulomb_drive", "rolling_resistance"), 3, id="drive and ground, 3"),
    *(pytest.param(effects, version, marks=pytest.mark.slow)
      for effects, version in ((("coulomb_drive",), 3), (("stribeck_drive",), 2))),
])  # fmt: skip
def test_dry_friction_sticks_and_slips_under_fmpys_solver_as_in_our_steps(fmpy, effects, version):
    exchanged, ours, modes = both_ways(fmpy, effects, version, {"state.theta_p": 0.02})
    np.testing.assert_allclose(exchanged, ours, atol=1e-6)
    assert all({0.0, 1.0} <= m or {0.0, -1.0} <= m for m in modes.values()), modes


@marked
@pytest.mark.parametrize(("effects", "start"), [
    (("external_push",), {"external_push.start": 0.123, "external_push.end": 0.3456}),
    pytest.param(("payload_step",), {"payload_step.time": 0.2345}, marks=pytest.mark.slow),
    (("winding_inductance", "presliding_drive"), {}),
])  # fmt: skip
def test_what_begins_lags_and_remembers_does_so_under_fmpys_solver(fmpy, effects, start):
    exchanged, ours, _ = both_ways(fmpy, effects, 2, {"state.theta_p": 0.02, **start})
    np.testing.assert_allclose(exchanged, ours, atol=1e-5)


@marked
@pytest.mark.slow
def test_in_play_our_steps_come_to_what_fmpys_solver_finds_as_they_become_short(fmpy):
    """Contact is stiff: at a thousandth of a second our steps are not yet as near as the solver is."""
    path, times = fmu_paths(ROBOT, ("backlash", "slosh"))[2], np.arange(0.0, 0.31, 0.05)
    given = {"start_values": {"state.theta_p": 0.02}, "stop_time": 0.3, "record_events": False,
             "input": stepped(times, 0.6 * np.sin(9.0 * times))}  # fmt: skip
    solved = fmpy.simulate_fmu(path, fmi_type="ModelExchange", relative_tolerance=1e-9, output_interval=0.01, **given)
    ours = fmpy.simulate_fmu(path, fmi_type="CoSimulation", output_interval=2e-5, **given)
    for name in ("theta_w", "theta_p", "dtheta_p"):
        assert solved[name][-1] == pytest.approx(ours[name][-1], abs=1e-6)


# -- derivatives


@marked
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("rate", [0.3, 0.0], ids=["slips", "sticks"])
def test_directional_derivatives_are_those_of_differences(fmpy, version, rate):
    effects = ("coulomb_drive", "presliding_drive", "winding_inductance")
    instance = Instance(ROBOT, effects, version, "ModelExchange")
    start = {"state.theta_p": 0.1, "state.dtheta_w": rate + 0.2, "state.dtheta_p": 0.2, "state.v_in_acting": 0.1}
    instance.begin(start | {"v_in": 0.3, "state.presliding_drive_force": 0.05})
    variables = fmu_variables(exported_with(ROBOT, effects))
    known = [v.name for v in (*variables.states, *variables.inputs)] + ["X1", "X5"]
    unknown = [v.name for v in (*variables.slopes, *variables.outputs)]
    assert instance.get("friction.direction[1]")[0] == (1.0 if rate else 0.0)
    size = len(variables.states)
    rates = instance.fmu.getDerivatives if version == 2 else instance.fmu.getContinuousStateDerivatives

    def at(name, offset):
        """All unknowns where one known is moved, as an importer moves it."""
        instance.settled()
        held = instance.get(*(v.name for v in variables.states))
        if name.startswith("state."):
            moved = held.copy()
            moved[known.index(name)] += offset
            instance.fmu.setContinuousStates((np.ctypeslib.as_ctypes(moved)), size)
        else:
            instance.set({name: instance.get(name)[0] + offset})
        found = np.zeros(size)
        rates(np.ctypeslib.as_ctypes(found), size)
        read = np.r_[found, instance.get(*unknown[size:])]
        instance.fmu.setContinuousStates(np.ctypeslib.as_ctypes(held.copy()), size)
        if not name.startswith("state."):
            instance.set({name: instance.get(name)[0] - offset})
        return read

    places = [instance.place[n] for n in unknown]
    for name in known:
        differences = (at(name, 1e-5) - at(name, -1e-5)) / 2e-5
        found = instance.fmu.getDirectionalDerivative(places, [instance.place[name]], [1.0])
        np.testing.assert_allclose(found, differences, rtol=1e-5, atol=1e-5 * max(1.0, abs(differences).max()))
    both = instance.fmu.getDirectionalDerivative(places, [instance.place[n] for n in ("v_in", "X1")], [2.0, 0.0])
    np.testing.assert_allclose(
        both, 2.0 * np.array(instance.fmu.getDirectionalDerivative(places, [instance.place["v_in"]], [1.0])), atol=1e-6
    )
    instance.close()


def rates_match_small_steps(plant, effects):
    """Derivatives of all states in model exchange are what the kernels make of a very short step."""
    e, h = exported_with(plant, effects), 1e-7
    state = np.linspace(0.03, 0.11, e.module.NX)
    given = (lambda u: u) if e.inputs <= 1 else (lambda u: np.full(e.inputs, u))
    kernels, arrays = kernels_start(e, state, given)
    values, before = start_values(e, arrays[0], arrays[1]), arrays[1].copy()
    variables = fmu_variables(e)
    instance = Instance(plant, effects, 2, "ModelExchange").begin(values | {v.name: 0.0 for v in variables.inputs})
    found = instance.get(*(v.name for v in variables.slopes))
    kernels.step_machine(0.0, h, given(0.0), arrays[0], h, *arrays[1:], np.zeros(e.module.NY))
    instance.close()
    np.testing.assert_allclose(found, (arrays[1] - before) / h, rtol=1e-3, atol=1e-3)


# -- what a simulator may do with an instance


@marked
@pytest.mark.parametrize("version", VERSIONS)
def test_a_saved_state_a_reset_and_parameters_that_are_set(fmpy, version):
    instance = Instance(ROBOT, ("coulomb_drive",), version).begin({"state.theta_p": 0.05, "coulomb_drive.torque": 0.2})

    def run(begin):
        for k in range(5):
            instance.fmu.doStep(begin + 0.001 * k, 0.001)
        return instance.get("theta_w", "theta_p", "dtheta_p")

    run(0.0)
    get = instance.fmu.getFMUstate if version == 2 else instance.fmu.getFMUState
    put = instance.fmu.setFMUstate if version == 2 else instance.fmu.setFMUState
    pack = instance.fmu.serializeFMUstate if version == 2 else instance.fmu.serializeFMUState
    unpack = instance.fmu.deSerializeFMUstate if version == 2 else instance.fmu.deserializeFMUState
    free = instance.fmu.freeFMUstate if version == 2 else instance.fmu.freeFMUState
    saved = get()
    again = unpack(pack(saved))
    first = run(0.005)
    put(again)
    assert run(0.005).tolist() == first.tolist()
    instance.set({"v_in": 1.0, "X5": 3.0})
    assert run(0.01).tolist() != first.tolist()
    free(saved), free(again)
    instance.fmu.reset()
    assert instance.get("X5", "coulomb_drive.torque", "state.theta_p").tolist() == [
        exported_with(ROBOT, ("coulomb_drive",)).parameters[4], 0.3, 0.0
    ]  # fmt: skip
    instance.close()


@marked
@pytest.mark.parametrize("version", VERSIONS)
def test_what_makes_no_sense_is_an_error_in_words(fmpy, version):
    from fmpy.fmi1 import FMICallException

    said = []
    instance = Instance(ROBOT, ("actuator_delay",), version, logged=lambda *given: said.append(given[-1].decode()))
    instance.begin({"state.theta_p": 0.05})
    wrong = {
        "A value must be a finite number": lambda: instance.set({"v_in": np.nan}),
        "A start value can be set before the initialisation ends": lambda: instance.set({"state.theta_w": 1.0}),
        "Only inputs, parameters and start values can be set": lambda: instance.set({"theta_w": 1.0}),
        "A communication step must be above zero": lambda: instance.fmu.doStep(0.0, 0.0),
        "A step must begin where the last one ended": lambda: instance.fmu.doStep(1.0, 0.001),
        "A delay must be 0 or above": lambda: instance.set({"actuator_delay.delay": -1e-3}),
    }
    for words, call in wrong.items():
        with pytest.raises(FMICallException):
            call()
        assert words in said[-1]
    instance.set({"v_in": 1e300})
    with pytest.raises(FMICallException):
        for k in range(100):
            instance.fmu.doStep(0.001 * k, 0.001)
    assert "the machine has run away" in said[-1]
    instance.close()


@marked
@pytest.mark.parametrize("version", VERSIONS)
def test_calls_are_taken_in_the_states_of_fmi_alone(fmpy, version):
    from fmpy.fmi1 import FMICallException

    said = []
    logged = lambda *given: said.append(given[-1].decode())  # noqa: E731
    instance = Instance(ROBOT, ("coulomb_drive",), version, "ModelExchange", logged)
    instance.begin({"state.theta_p": 0.05})
    instance.set({"X1": 0.01})
    instance.settled()
    instance.fmu.enterContinuousTimeMode()
    wrong = {
        "A parameter can be set before the start, in event mode": lambda: instance.set({"X1": 0.02}),
        "This must be called in model exchange, in event mode": instance.settled,
        "This must be called during the initialisation": instance.fmu.exitInitializationMode,
    }
    instance.set({"v_in": 0.1})
    for words, call in wrong.items():
        with pytest.raises(FMICallException):
            call()
        assert words in said[-1]
    instance.fmu.terminate()
    with pytest.raises(FMICallException):
        instance.set({"v_in": 0.2})
    assert instance.get("v_in", "X1").tolist() == [0.1, 0.01] and "after the end" in said[-1]
    instance.close()


@marked
@pytest.mark.parametrize("version", VERSIONS)
def test_in_co_simulation_outputs_have_derivatives_along_states_and_late_inputs_none(fmpy, version):
    instance = Instance(ROBOT, ("actuator_delay",), version).begin({"state.theta_p": 0.05, "v_in": 0.5})
    instance.fmu.doStep(0.0, 0.002)
    place, ways = instance.place, instance.fmu.getDirectionalDerivative
    along = {n: ways([place["theta_p"], place["der(state.dtheta_p)"]], [place[n]], [1.0])
             for n in ("state.theta_p", "v_in")}  # fmt: skip
    assert along["state.theta_p"][0] == pytest.approx(1.0) and abs(along["state.theta_p"][1]) > 1.0
    assert along["v_in"] == pytest.approx([0.0, 0.0])
    before = instance.get("der(state.dtheta_p)")[0]
    instance.set({"v_in": -0.5})
    assert instance.get("der(state.dtheta_p)")[0] == before  # it acts later
    instance.close()


@marked
def test_the_description_says_what_the_binary_can(fmpy):
    friction = fmu_content(exported_with(ROBOT, ("coulomb_drive",)), 2)["modelDescription.xml"].decode()
    late = fmu_content(exported_with(ROBOT, ("imu_lag",)), 3)["modelDescription.xml"].decode()
    reset = re.findall(r'name="(\S+)".*\n.*reinit="true"', friction)
    assert reset == ["state.dtheta_w", "state.dtheta_p"]  # what is stopped has another rate at once
    assert friction.count('providesDirectionalDerivative="true"') == 2 and "reinit" not in late
    assert late.count('providesDirectionalDerivatives="true"') == 1  # late readings know no state of now
    assert re.search(r'name="imu_lag.delay".* min="0.0"', late)
    assert friction.count('canNotUseMemoryManagementFunctions="true"') == 2


def test_the_token_follows_from_all_that_is_inside():
    exported = exported_with(ROBOT, ("coulomb_drive",))
    other = replace(exported, sigma={"coulomb_drive.torque": 0.5})
    found = [re.search("#define WP_TOKEN (.*)", fmu_sources(e, v)["wheelpend_fmu.h"])[1]
             for e, v in ((exported, 2), (exported, 2), (exported, 3), (other, 2))]  # fmt: skip
    assert found[0] == found[1] and len(set(found)) == 3


@needs_gcc
@pytest.mark.parametrize(
    ("version", "harness"), [pytest.param(2, "fmu_harness.c", marks=pytest.mark.slow), (3, "fmu_harness3.c")]
)
def test_an_fmu_touches_nothing_that_is_not_its_own(version, harness, tmp_path):
    """The sanitizers stay silent over both kinds, and they tell of memory that is never given back."""
    exported = exported_with(ROBOT, ("coulomb_drive", "actuator_delay", "imu_lag", "payload_step"))
    for name, text in fmu_sources(exported, version).items():
        (tmp_path / name).write_text(text)
    checks = ("-g", "-fsanitize=undefined,address", "-fno-sanitize-recover=all")
    units = ["wheelpend_model.c", "instance.c", f"{HERE}/{harness}"]
    flags = [f for f in STRICT if f != "-Wconversion"]  # the harness adds statuses up
    command = ["gcc", *flags, *checks, "-I", ".", *units, "-o", "harness", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "harness"], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and np.isfinite(np.array(done.stdout.split(), dtype=float)).all(), done.stderr


@marked
@pytest.mark.parametrize("version", VERSIONS)
def test_functions_are_declared_as_in_the_standards_own_headers(fmpy, version, tmp_path):
    headers = Path(fmpy.__file__).with_name("c-code")
    for name, text in fmu_sources(exported_with(ROBOT, ()), version).items():
        (tmp_path / name).write_text(text)
    unit = f"""#include "fmi{version}Functions.h"
        #define WHEELPEND_FMI{version}_H
        #define FMI{version}_EXPORT FMI{version}_Export
        #define FMI{version}(name) fmi{version}##name
        #include "fmi{version}.c\""""
    (tmp_path / "unit.c").write_text("\n".join(line.strip() for line in unit.splitlines()) + "\n")
    command = ["gcc", "-std=c99", "-Wall", "-Werror", "-isystem", headers, "-I", ".", "-c", "unit.c"]
    subprocess.run(command, cwd=tmp_path, check=True)
    text = (headers / f"fmi{version}Functions.h").read_text()
    declared = re.findall(rf"#define (fmi{version}\w+) +fmi{version}FullName", text)
    folder = Path(fmpy.extract(fmu_paths(ROBOT, ())[version], tmp_path / "fmu"))
    library = ctypes.CDLL(str(next(folder.glob("binaries/*/*.so"))))
    assert len(declared) > 30 and [n for n in declared if not hasattr(library, n)] == []


# -- every effect


def exported_and_checked(plant, effects, tmp_path, compilers):
    from fmpy.validation import validate_fmu

    for compiler in compilers:
        compiled_strictly(exported_with(plant, effects), tmp_path, compiler)
    reference, values = in_kernels(exported_with(plant, effects), 20)
    for version in (2, 3):
        assert validate_fmu(fmu_paths(plant, effects)[version]) == []
        found = in_co_simulation(plant, effects, version, values, [1] * 20)
        np.testing.assert_allclose(found, reference, atol=1e-10)
    rates_match_small_steps(plant, effects)


def solved_as_stepped(fmpy, plant):
    """Outputs after 0.2 s in model exchange, by CVode, are those of co-simulation."""
    e, times = exported_with(plant, ()), np.arange(0.0, 0.21, 0.05)
    held = {n: 0.3 * np.cos(7.0 * times + place) for place, n in enumerate(e.module.INPUTS[: e.inputs])}
    rows = [(t, *(u[max(k - late, 0)] for u in held.values())) for k, t in enumerate(times) for late in (1, 0)]
    given = np.array(rows, dtype=[("time", float), *((n, float) for n in held)]) if held else None
    for version in (2, 3):
        found = [
            fmpy.simulate_fmu(
                fmu_paths(plant, ())[version], fmi_type=kind, stop_time=0.2, output_interval=0.01, input=given,
                relative_tolerance=1e-10, start_values={fmu_variables(e).states[0].name: 0.1}, record_events=False,
            )[-1]
            for kind in ("ModelExchange", "CoSimulation")
        ]  # fmt: skip
        ways = [np.array([row[n] for n in e.module.OUTPUTS]) for row in found]
        np.testing.assert_allclose(ways[0], ways[1], atol=1e-6)
        assert np.abs(ways[0]).max() > 1e-3


def some_quick(quick, every):
    """All cases, of which these few are tried every time."""
    return [pytest.param(*case, id="-".join(case), marks=() if case in quick else pytest.mark.slow) for case in every]


@pytest.mark.slow
@marked
def test_a_machine_of_two_inputs_is_exported(fmpy, tmp_path):
    exported_and_checked("arm", (), tmp_path, ["gcc"])


@marked
@pytest.mark.parametrize(("machine",), some_quick([], [(n,) for n in (*OTHER_MACHINES, "slide", "cart_pole")]))
def test_every_plant_is_exported_as_an_fmu(fmpy, machine, tmp_path):
    """Also of several inputs, or none, or written by a user."""
    exported_and_checked(machine, (), tmp_path, [c for c in ("gcc", "clang") if shutil.which(c)])
    solved_as_stepped(fmpy, machine)


@marked
@pytest.mark.parametrize(
    ("plant", "effect"),
    some_quick([], [p.values for p in every_effect()]),
)
def test_every_effect_of_the_library_is_exported_as_an_fmu(fmpy, plant, effect, tmp_path):
    try:
        exported_with(plant, (effect,))
    except Failure as failure:
        pytest.skip(str(failure))
    exported_and_checked(plant, (effect,), tmp_path, [c for c in ("gcc", "clang") if shutil.which(c)])


# -- the files and their ledger


@marked
def test_the_python_of_the_page_runs(fmpy, tmp_path, monkeypatch, capsys):
    (code,) = (b.text for b in blocks((ROOT / "docs/export_fmu.md").read_text("utf-8")) if b.language == "python")
    (tmp_path / "export-fmu").mkdir()
    for path in fmu_paths(ROBOT, ()).values():
        shutil.copy(path, tmp_path / "export-fmu")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "docs/export_fmu.md", "exec"), {})
    assert 0.0 < abs(float(capsys.readouterr().out)) < 1.0


@marked
def test_a_log_is_replayed_in_the_fmu_as_we_predict_it(fmpy):
    log = simulated(duration=1.5, seed=2, coulomb_drive__torque=0.3)
    ledger = export_model(model_with("coulomb_drive"), "fmu", log).ledger
    assert ledger.error_in_target == pytest.approx(ledger.error, rel=1e-9)
    assert "run by FMPy" in ledger.replayed
    assert set(ledger.files) == {"wheelpend_wheel_pendulum_fmi2.fmu", "wheelpend_wheel_pendulum_fmi3.fmu"}


@marked
@pytest.mark.slow
def test_a_log_with_delays_and_jitter_is_replayed_as_we_predict_it(fmpy):
    log = simulated(duration=1.5, seed=2, coulomb_drive__torque=0.3, actuator_delay__delay=0.0035)
    ledger = export_model(model_with("coulomb_drive", "actuator_delay", "imu_lag"), "fmu", log).ledger
    assert ledger.error_in_target == pytest.approx(ledger.error, rel=0.02)  # a delay cuts the steps elsewhere


@pytest.mark.slow
@marked
def test_where_an_fmu_refuses_the_ledger_says_what_it_said(fmpy, monkeypatch):
    monkeypatch.setattr("wheelpend.export.fmu_replay.finite", lambda value: np.nan)
    ledger = export_model(model_with("coulomb_drive"), "fmu", simulated(duration=1.0, seed=2)).ledger
    assert ledger.error_in_target is None
    assert ledger.replayed.startswith("the FMU refused: A value must be a finite number")


@needs_gcc
def test_without_fmpy_the_ledger_says_so(monkeypatch):
    monkeypatch.setattr("wheelpend.export.fmu_replay.importlib.util.find_spec", lambda name: None)
    ledger = export_model(model_with("coulomb_drive"), "fmu", simulated(duration=1.0, seed=2)).ledger
    assert ledger.error_in_target is None and "In the target: not known, FMPy is not installed here." in ledger.text()


@pytest.mark.slow
@needs_gcc
def test_a_second_export_replaces_the_first_and_no_fmu_that_was_changed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    workspace.create(tmp_path)
    run("export", "fmu")
    run("export", "fmu")
    changed = tmp_path / "export-fmu/wheelpend_wheel_pendulum_fmi3.fmu"
    changed.write_bytes(b"mine")
    assert "was changed since" in " ".join(run("export", "fmu", code=1).output.split())
    assert changed.read_bytes() == b"mine"


def test_a_delay_is_carried_in_co_simulation_alone():
    carried = fmu_carried(exported_with(ROBOT, ("coulomb_drive", "actuator_delay")))
    assert carried["coulomb_drive"].carried == "exactly" and carried["actuator_delay"].carried == "approximately"
    assert "in model exchange not" in carried["actuator_delay"].note


def test_without_a_compiler_there_are_sources_and_the_ledger_says_so(monkeypatch):
    monkeypatch.setenv("PATH", "/nonexistent")
    monkeypatch.delenv("CC", raising=False)
    files = fmu_files(exported_with(ROBOT, ()))
    assert fmu_notes(files) == ["There are sources and no binary, for no C compiler is installed here."]
    for version, content in zip((2, 3), files.values(), strict=True):
        names = zipfile.ZipFile(io.BytesIO(content)).namelist()
        assert {"modelDescription.xml", "sources/instance.c", f"sources/fmi{version}.c"} <= set(names)


@needs_gcc
def test_the_same_model_is_the_same_file():
    made = fmu_files(exported_with(ROBOT, ()))
    assert list(made.values()) == [Path(p).read_bytes() for p in fmu_paths(ROBOT, ()).values()]


@pytest.mark.parametrize(("text", "name", "base"), [
    ("V s²/rad", "V.s2/rad", {"kg": 1, "m": 2, "s": -1, "A": -1, "rad": -1}),
    ("rad/s", "rad/s", {"s": -1, "rad": 1}),
    ("N m/V", "N.m/V", {"s": 1, "A": 1}),
    ("V/rad s", "V/(rad.s)", {"kg": 1, "m": 2, "s": -4, "A": -1, "rad": -1}),
    ("1/s", "1/s", {"s": -1}),
])  # fmt: skip
def test_units_are_those_of_modelica_and_si(text, name, base):
    assert fmi_unit(text).name == name and dict(fmi_unit(text).base) == base


def test_a_unit_of_unknown_parts_has_a_name_alone():
    assert fmi_unit("furlong/s").base is None
    assert [per_second(u) for u in ("rad", "rad/s", "V/rad")] == ["rad/s", "rad/s²", "V/rad s"]


def test_a_name_that_is_no_identifier_stands_in_quotes():
    assert (
        structured("own law.size") == "'own law'.size" and structured("coulomb_drive.torque") == "coulomb_drive.torque"
    )
