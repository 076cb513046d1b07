"""Models to export, and their kernels run by Python alone, as what every language must agree with."""

import subprocess
from types import ModuleType

import numpy as np

import derive
from wheelpend.export.c_target import SOURCE_FILE, c_files
from wheelpend.export.compensation import compensation_of
from wheelpend.export.javascript_target import MODULE_FILE, javascript_files
from wheelpend.model.record import Model

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-ffp-contract=off", "-O1")
SAMPLES = 40
COMMANDS = 0.4 * np.sin(0.6 * np.arange(SAMPLES)) + 0.1 * np.cos(3.1 * np.arange(SAMPLES))
HERE = __file__.rpartition("/")[0]


def model_with(*effects, plant="wheel_pendulum"):
    """A plant with effects of their typical sizes, each known to two percent."""
    bare = Model.default(plant)
    model = bare.with_effects(effects)
    rows = [derive.effects.in_plant_units(derive.effects.find(e), model.plant_signature) for e in effects]
    values = {row.name_of(p): (p.typical, abs(p.typical) * 0.02) for row in rows for p in row.parameters}
    return model.with_fit(values)


def interpreted(text):
    """A generated module whose functions Python runs, one operation after the other."""
    module = ModuleType("interpreted")
    plain = text.replace("from numba import njit", "njit = lambda **options: lambda function: function")
    exec(compile(plain, "interpreted", "exec"), module.__dict__)
    return module


def numbers_of_python(exported):
    """What harness.c prints, by the interpreted kernels."""
    e, m = exported, interpreted(exported.text)
    compensation = compensation_of(e)
    inputs = max(e.inputs, 1)
    given = (lambda u: u) if inputs == 1 else (lambda u: np.full(inputs, u))
    state = np.zeros(m.NX)
    state[0], state[-1] = 0.01, 0.05
    ring = (e.commands,) if e.inputs <= 1 else (e.commands, e.inputs)
    machine = [e.parameters.copy(), np.zeros(e.size), np.zeros(ring), np.zeros((e.late_readings, m.NY))]
    m.start_machine(state, given(0.0), *machine)
    output = np.zeros(m.NY)
    m.read_sensors(0.0, machine[1], machine[0], output)
    filters = []
    for columns in (np.zeros(0, np.int64), e.learnt):
        n, count = len(columns), len(e.sources)
        f = {
            "parameters": e.parameters.copy(), "columns": columns, "now": np.zeros(e.size), "commands": np.zeros(ring),
            "sens": np.zeros((e.size, e.size + m.NQ + n)), "force": np.zeros(count), "force_by": np.zeros((count, n)),
            "covariance": np.zeros((e.size + count, e.size + count)), "rubbing": np.zeros(m.SURFACES),
            "innovation": np.zeros(m.NY),
        }  # fmt: skip
        f["learnt"] = np.diag(e.doubt if n else np.zeros(0))
        f["noise"] = (e.noise_at_start if n else e.noise).copy()
        moving = [f[k] for k in ("sens", "force", "force_by", "covariance", "rubbing")]
        m.start_filter(state, e.spread, given(0.0), f["parameters"], e.reads, f["noise"], f["now"], f["commands"],
                       *moving)  # fmt: skip
        filters.append(f)
    shown, time, weight = [], 0.0, 1.0 / e.readings_sigma
    for wanted in COMMANDS:
        for f in filters:
            learns = len(f["columns"]) > 0
            least = e.least if learns else np.zeros(0)
            moving = [f[k] for k in ("sens", "force", "force_by", "covariance")]
            m.filter_readings(time, output, weight, f["parameters"], f["columns"], e.reads, f["now"], *moving,
                              f["learnt"], least, f["innovation"], np.zeros(m.NY), np.zeros(m.NY))  # fmt: skip
            if learns:
                m.adapt_filter(time, e.period, 1.0, e.doubt, f["learnt"], f["force"], f["force_by"], f["covariance"],
                               f["noise"])  # fmt: skip
        command = wanted
        if compensation:
            c = compensation
            command = m.compensate(0.0, wanted, filters[0]["now"], c.forces, c.absent, c.maps, c.shares, c.least_slip,
                                   c.least_input)  # fmt: skip
            shown.append(command)
        rates = np.zeros(m.NX)
        m.machine_rates(time, machine[1], given(command), machine[0], rates)
        shown += rates.tolist()
        for f in filters:
            moving = [f[k] for k in ("sens", "force", "force_by", "covariance", "rubbing")]
            m.filter_step(time, e.period, given(command), f["parameters"], f["columns"], e.forces, e.mixing, e.reads,
                          f["noise"], e.max_step, f["now"], f["commands"], *moving)  # fmt: skip
        m.step_machine(time, e.period, given(command), machine[0], e.max_step, *machine[1:], output)
        time += e.period
        observer, identifier = filters
        shown += [*machine[1], *output, *observer["now"], *observer["force"], *observer["innovation"]]
        shown += identifier["parameters"][e.learnt].tolist()
    a, b, c = np.zeros((m.NX, m.NX)), np.zeros((m.NX, inputs)), np.zeros((m.NY, m.NX))
    m.linearise_machine(time, machine[1], given(command), machine[0], 1e-3, a, b, c)
    return np.array([*shown, *a.ravel(), *b.ravel(), *c.ravel()])


def numbers_of_c(exported, folder, *options, compiler="gcc"):
    """The same by the C code, compiled so that no warning passes."""
    for name, text in c_files(exported).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    flags = [*STRICT, *options, *(["-DCOMPENSATES"] if compensation_of(exported) else [])]
    source = folder / "src" / SOURCE_FILE
    subprocess.run([compiler, *flags, "-ffreestanding", "-c", source, "-o", folder / "model.o"], check=True)
    command = [compiler, *flags, "-I", folder / "src", source, f"{HERE}/harness.c", "-o", folder / "harness", "-lm"]
    subprocess.run(command, check=True)
    return printed([folder / "harness"])


def numbers_of_javascript(exported, folder):
    """The same by the ES module."""
    (folder / MODULE_FILE).write_text(javascript_files(exported)[MODULE_FILE])
    return printed(["node", f"{HERE}/harness.mjs", (folder / MODULE_FILE).as_uri()])


def printed(command):
    """Numbers that a program prints for the commands."""
    given = "\n".join(map(repr, COMMANDS.tolist()))
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return np.array(done.stdout.split(), dtype=float)
