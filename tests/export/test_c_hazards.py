"""The C library among what firmware meets: readings that are none, glitches, wrong builds; its examples."""

import itertools
import re
import shutil
import subprocess
from functools import partial

import numpy as np
import pytest

from tests.export.exporting import HERE, STRICT, interpreted, model_with
from tests.plants.machines import model_of
from wheelpend.export.c_target import SOURCE_FILE, ascii_only, c_files
from wheelpend.export.exported_model import exported_model
from wheelpend.model.record import Model

needs_gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="needs gcc")
ARDUINO = '#include <math.h>\n#include <stdint.h>\nextern "C" unsigned long micros(void);\n'
MANY = ("presliding_drive", "actuator_delay", "imu_lag", "winding_inductance")
COMPILERS = [c for c in ("gcc", "clang") if shutil.which(c)]
SANITIZED = ("-g", "-fsanitize=undefined,address", "-fno-sanitize-recover=all")
LIMIT_S = 60.0  # a program that does not end is stopped


def exported_to(folder, model):
    """A folder with an exported library."""
    for name, text in c_files(exported_model(model)).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def compiled(folder, *options, program="", compiler="gcc"):
    """What a compiler says of library and program; the program stands as `program` then."""
    sources = ["-I", folder / "src", folder / "src" / SOURCE_FILE, *([program] if program else ["-c"])]
    command = [compiler, *STRICT, *options, *sources, "-o", folder / "program", *(["-lm"] if program else [])]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The library of a robot with dry friction."""
    return exported_to(tmp_path_factory.mktemp("library"), model_with("coulomb_drive"))


@pytest.fixture(scope="module", params=["double", pytest.param("float", marks=pytest.mark.slow)])
def hazards(request, library):
    """What hazards.c prints, in lines by their names."""
    if not shutil.which("gcc"):
        pytest.skip("needs gcc")
    options = ["-DWP_SINGLE"] if request.param == "float" else []
    made = compiled(library, *options, *SANITIZED, program=f"{HERE}/hazards.c")
    assert made.returncode == 0, made.stderr
    done = subprocess.run([library / "program"], capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, done.stderr
    found = {}
    for line in done.stdout.splitlines():
        name, *numbers = line.split()
        found.setdefault(name, []).append([float(n) for n in numbers])
    return found


def test_a_reading_that_is_none_or_far_off_is_refused_and_forgotten(hazards):
    for name in ("infinite", "minus", "nan", "glitch"):
        assert [int(row[0]) for row in hazards[name]] == [6, 5, 3]  # all but that sensor's bit
        assert max(row[1] for row in hazards[name]) < 0.01 and all(row[2] for row in hazards[name])
    for name in ("plain", "command", "after"):
        assert max(row[1] for row in hazards[name]) < 0.01 and all(row[0] == 7 and row[2] for row in hazards[name])


def test_a_filter_that_is_wrong_itself_believes_its_sensors_again(hazards):
    assert hazards["lost"][0][:2] == [4, pytest.approx(1.0, abs=0.01)]
    assert hazards["doubts"][0][1] < 0.02 and hazards["found"][0][1] < 0.01
    assert hazards["later"][0][2] == 1 and hazards["later"][0][3] < 1.5


def test_an_observer_that_is_no_number_says_so_and_begins_anew(hazards):
    assert hazards["sick"][0][2] == 0
    assert hazards["anew"][0][1] < 0.01 and hazards["anew"][0][2] == 1


def test_no_step_and_no_period_hangs_and_zeros_do_nothing(hazards):
    assert hazards["steps"][0][1] < 0.01
    assert hazards["period"][0][0] == 0 and hazards["period"][0][2] == 0
    assert hazards["zeros"] == [[0, 0, 0, 0]]


def test_the_compensator_of_what_is_not_finite_is_nothing(hazards):
    infinite, minus, none, large, negative, _, rest, usual, lost = hazards["compensate"][0]
    assert [infinite, minus, none, lost] == [0, 0, 0, 0]
    assert (large, negative) == (pytest.approx(1e8), pytest.approx(-1e8))
    assert rest == pytest.approx(0.0, abs=1e-6) and usual == pytest.approx(2.288, rel=1e-6)
    assert np.isfinite(hazards["compensate"][0]).all()


def test_time_goes_on_after_a_day_and_a_half_in_float(hazards):
    assert hazards["time"][0][0] == pytest.approx(131072.0 + 64.0, abs=0.02)


LATE_PROGRAM = """
#include "wheelpend_model.h"

#include <stdio.h>

static wp_machine machine;
static wp_observer observer;

int main(void) {
    volatile double huge = 1e308;
    const wp_real infinite = (wp_real)(huge * 10.0);
    const wp_real delays[] = {WP_R(0.0), WP_R(-0.01), WP_R(-1e30), infinite - infinite, WP_R(1e30), infinite};
    for (int i = 0; i < 6; i++) {
        wp_real state[WP_STATES] = {WP_R(0.0)};
        wp_real output[WP_OUTPUTS];
        wp_machine_init(&machine);
        wp_observer_init(&observer);
        machine.parameters[WP_ACTUATOR_DELAY_DELAY] = machine.parameters[WP_IMU_LAG_DELAY] = delays[i];
        observer.parameters[WP_ACTUATOR_DELAY_DELAY] = delays[i];
        wp_machine_start(&machine, state, WP_R(0.0));
        wp_observer_start(&observer, state, WP_R(0.0));
        for (int k = 0; k < 3; k++) {
            wp_machine_step(&machine, WP_R(1.0), output);
            wp_observer_predict(&observer, WP_R(1.0));
        }
        printf("%.9g %.9g\\n", (double)machine.now[WP_STATE_THETA_W], (double)observer.now[WP_STATE_THETA_W]);
    }
    return 0;
}
"""


@needs_gcc
@pytest.mark.parametrize(
    "precision", [pytest.param((), id="double"), pytest.param(("-DWP_SINGLE",), id="float", marks=pytest.mark.slow)]
)
def test_a_delay_that_is_none_is_no_delay_and_one_without_end_the_longest(tmp_path, precision):
    exported_to(tmp_path, model_with("actuator_delay", "imu_lag"))
    (tmp_path / "late.c").write_text(LATE_PROGRAM)
    made = compiled(tmp_path, *precision, *SANITIZED, program=tmp_path / "late.c")
    assert made.returncode == 0, made.stderr
    done = subprocess.run([tmp_path / "program"], capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, done.stderr
    prompt, *others = [[float(n) for n in line.split()] for line in done.stdout.splitlines()]
    assert prompt[0] > 0.0 and prompt[1] > 0.0
    assert others == [prompt] * 3 + [[0.0, 0.0]] * 2


@needs_gcc
def test_two_precisions_do_not_link(library, tmp_path):
    whole, part = library / "src" / SOURCE_FILE, f"{HERE}/hazards.c"
    for names in (("-DWP_SINGLE", ""), ("", "-DWP_SINGLE")):
        objects = []
        for source, option in zip((whole, part), names, strict=True):
            objects.append(tmp_path / f"part{len(objects)}.o")
            command = [
                "gcc",
                *STRICT,
                "-I",
                library / "src",
                *([option] if option else []),
                "-c",
                source,
                "-o",
                objects[-1],
            ]
            subprocess.run(command, check=True)
        done = subprocess.run(
            ["gcc", *objects, "-o", tmp_path / "mixed", "-lm"], capture_output=True, text=True, check=False
        )
        assert done.returncode and "undefined reference" in done.stderr


@needs_gcc
def test_a_file_beside_the_header_says_the_precision_for_all(tmp_path):
    folder = exported_to(tmp_path, model_with("coulomb_drive"))
    (folder / "src/wheelpend_config.h").write_text("#define WP_SINGLE\n")
    (folder / "main.c").write_text(
        '#include "wheelpend_model.h"\nint main(void) { return sizeof(wp_real) == sizeof(float) ? 0 : 1; }\n'
    )
    assert compiled(folder, program=folder / "main.c").returncode == 0
    assert subprocess.run([folder / "program"], check=False).returncode == 0


@needs_gcc
def test_a_build_in_which_it_would_be_wrong_is_refused(library):
    for option in ("-ffast-math", "-ffinite-math-only"):
        assert "-ffast-math takes away" in compiled(library, option).stderr
        assert compiled(library, option, "-DWP_ALLOW_FAST_MATH").returncode == 0
    narrow = ["-include", "limits.h", "-U__INT_MAX__", "-D__INT_MAX__=32767"]
    assert "int must have 32 bits" in compiled(library, *narrow).stderr
    short = ["-U__DBL_MANT_DIG__", "-D__DBL_MANT_DIG__=24"]
    assert "define WP_SINGLE" in compiled(library, *short).stderr


EXAMPLES = {
    "robot": lambda: model_with("coulomb_drive"),
    "robot with many effects": lambda: model_with(*MANY),
    "pendulum": lambda: model_with(plant="pendulum"),
    "slide": lambda: model_with(plant="slide"),
    **{
        name: partial(model_of, name)
        for name in ("cart_pole", "driven pendulum", "driven second link", "arm", "turning")
    },
}


QUICK_EXAMPLES = ("robot with many effects", "pendulum")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK_EXAMPLES else pytest.mark.slow) for name in EXAMPLES]
)
@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
def test_the_examples_compile_without_a_warning_and_the_machine_stays(name, tmp_path):
    folder = exported_to(tmp_path, EXAMPLES[name]())
    (folder / "Arduino.h").write_text(ARDUINO)
    for compiler, single in itertools.product(COMPILERS, ((), ("-DWP_SINGLE",))):
        made = compiled(folder, *single, program=folder / "examples/desktop/balance.c", compiler=compiler)
        assert made.returncode == 0, made.stderr
        shown = subprocess.run([folder / "program"], capture_output=True, text=True, timeout=LIMIT_S, check=True).stdout
        assert len(shown.splitlines()) == 21 and "is off" not in shown
        if name in ("robot", "robot with many effects", "cart_pole", "turning"):
            pitch = [float(line.split(" theta_p")[1].split()[0]) for line in shown.splitlines()]
            assert max(map(abs, pitch)) < 0.05 and abs(pitch[-1]) < 2e-3
        plus = {"gcc": "g++", "clang": "clang++"}[compiler]
        if shutil.which(plus):
            flags = ["-std=c++17", *STRICT[1:], *single, "-include", folder / "Arduino.h", "-x", "c++", "-c"]
            sketch = [folder / "examples/balance/balance.ino", "-I", folder / "src", "-o", folder / "sketch.o"]
            subprocess.run([plus, *flags, *sketch], check=True)


FALLS = """
#define main balance
#include "balance.c"
#undef main
static int modes(wp_real pitch, int samples) {
    wp_real measured[WP_OUTPUTS] = {WP_R(0.0)}, command[1];
    measured[WP_READ_THETA_P] = pitch;
    for (int k = 0; k < samples; k++) {
        sample(measured, command);
        wp_observer_predict(&observer, cut(command[0]));
    }
    return 10 * mode + (command[0] < WP_R(0.0) || command[0] > WP_R(0.0));
}
int main(void) {
    volatile double huge = 1e308;
    const wp_real none = (wp_real)(huge * 10.0) - (wp_real)(huge * 10.0);
    (void)balance;
    wp_observer_init(&observer);
    printf("%d ", modes(WP_R(1.0), 1000));
    printf("%d ", modes(WP_R(0.01), READY_SAMPLES - 1));
    printf("%d ", modes(WP_R(0.01), 3));
    printf("%d ", modes(WP_R(1.0), 30));
    printf("%d ", modes(WP_R(0.01), READY_SAMPLES - 1));
    printf("%d ", modes(WP_R(0.01), 1));
    printf("%d ", modes(none, SILENT_SAMPLES));
    printf("%d ", modes(none, 1));
    sum = WP_R(0.0);
    modes(WP_R(0.01), READY_SAMPLES);
    const wp_real before = sum;
    observer.now[WP_STATE_THETA_P] = WP_R(0.5);
    control();
    printf("%d\\n", sum < before || sum > before);
    return 0;
}
"""


@needs_gcc
def test_a_robot_that_fell_is_switched_off_until_it_is_set_up_again(library):
    (library / "falls.c").write_text(FALLS)
    made = compiled(library, "-I", library / "examples/desktop", program=library / "falls.c")
    assert made.returncode == 0, made.stderr
    shown = subprocess.run([library / "program"], capture_output=True, text=True, timeout=LIMIT_S, check=True).stdout
    idle, run, fallen = 0, 11, 20
    assert list(map(int, shown.split())) == [idle, idle, run, fallen, fallen, run, run, fallen, 0]


SILENT = """
#define main balance
#include "balance.c"
#undef main
static int runs(wp_real place, int samples) {
    wp_real measured[WP_OUTPUTS] = {WP_R(0.0)}, command[1];
    int count = 0;
    measured[WP_READ_X] = place;
    for (int k = 0; k < samples; k++) {
        sample(measured, command);
        count += mode == RUN;
        wp_observer_predict(&observer, cut(command[0]));
    }
    return count;
}
int main(void) {
    volatile double huge = 1e308;
    const wp_real none = (wp_real)(huge * 10.0) - (wp_real)(huge * 10.0);
    (void)balance;
    wp_observer_init(&observer);
    printf("%d ", runs(WP_R(1e-4), READY_SAMPLES + 9) - 10);
    printf("%d ", runs(none, 1000) - SILENT_SAMPLES);
    printf("%d\\n", runs(WP_R(1e-4), READY_SAMPLES) - 1);
    return 0;
}
"""


@needs_gcc
def test_a_machine_that_cannot_fall_is_off_while_its_sensor_says_nothing(tmp_path):
    folder = exported_to(tmp_path, model_with(plant="slide"))
    (folder / "silent.c").write_text(SILENT)
    made = compiled(folder, "-I", folder / "examples/desktop", program=folder / "silent.c")
    assert made.returncode == 0, made.stderr
    shown = subprocess.run([folder / "program"], capture_output=True, text=True, timeout=LIMIT_S, check=True).stdout
    assert list(map(int, shown.split())) == [0, 0, 0]


def test_the_controller_of_an_example_sees_what_the_models_does():
    toml = """plant = "pendulum"
[assumptions]
links = 2
driven = "second"
second_encoder = "relative"
[parameters]
X1 = { nominal = 0.2 }
X2 = { nominal = 0.05 }
X3 = { nominal = 0.06 }
X4 = { nominal = 1.0 }
X5 = { nominal = 0.5 }
X6 = { nominal = 0.1 }
X7 = { nominal = 0.1 }
[controller]
kind = "pid"
gains = [5.0, 0.5, 0.3]
"""
    loop = c_files(exported_model(Model.parse(toml)))["examples/desktop/balance.c"]
    now = "observer.now[WP_STATE_{}]"
    angle = " + ".join((f"-{now.format('THETA_1')}", now.format("THETA_2")))
    rate = " + ".join((f"-{now.format('DTHETA_1')}", now.format("DTHETA_2")))
    assert f"error = -({angle});" in loop and f"rate = {rate};" in loop


def test_its_comments_are_ascii_and_say_what_the_readings_are(library):
    for path in library.rglob("*.[ch]"):
        for comment in re.findall(r"/\*.*?\*/", path.read_text("ascii"), re.DOTALL):
            assert "?" not in comment
    assert ascii_only("Söderström 1/σ, Ω ≤ 3 – ½") == "Soderstrom 1/sigma, omega <= 3 - 1/2"
    header = (library / "src/wheelpend_model.h").read_text()
    assert "WP_READ_THETA_P [rad]: grows when the body leans forward; 0 upright" in header
    assert "An encoder in the body reads theta_w - theta_p: add theta_p." in header
    assert "enum {WP_STATE_THETA_W, WP_STATE_THETA_P, WP_STATE_DTHETA_W, WP_STATE_DTHETA_P};" in header
    assert "the voltage that reached the motor" in " ".join(header.split())


def test_another_model_has_another_name_and_the_same_one_the_same(library):
    def name(*effects):
        header = c_files(exported_model(model_with(*effects)))["src/wheelpend_model.h"]
        return re.search(r'WP_MODEL_ID "(\w{16})"', header)[1]

    assert f'"{name("coulomb_drive")}"' in (library / "src/wheelpend_model.h").read_text()
    assert name("coulomb_drive") != name("cogging")


# -- the kernels' gate, in every language


def readings_of(gate, measured):
    """What the kernel takes of readings, and the pitch that it then knows."""
    e = exported_model(model_with("coulomb_drive"))
    m = interpreted(e.text)
    count = len(e.sources)
    now, innovation, taken = np.zeros(e.size), np.zeros(3), np.full(3, -1.0)
    moving = [np.zeros((e.size, e.size + 2)), np.zeros(count), np.zeros((count, 0)), np.zeros((e.size + count,) * 2)]
    own = e.parameters.copy()
    m.start_filter(np.zeros(4), 0.001 * e.spread, 0.0, own, e.reads, e.noise, now, np.zeros(e.commands), *moving,
                   np.zeros(m.SURFACES))  # fmt: skip
    with np.errstate(invalid="ignore"):  # infinite less infinite tells what is not finite
        m.filter_readings(0.0, np.array(measured), 1.0 / e.readings_sigma, own, np.zeros(0, np.int64), e.reads, now,
                          *moving, np.zeros((0, 0)), np.zeros(0), innovation, np.full(3, gate), taken)  # fmt: skip
    return taken.tolist(), now, innovation


def test_the_gate_is_in_standard_deviations_of_what_is_expected():
    sigma = np.hypot(0.5 * np.pi / 180.0, 1e-4)
    for factor, is_taken in ((9.9, 1.0), (10.1, 0.0), (-10.1, 0.0)):
        taken, now, innovation = readings_of(10.0, [0.0, factor * sigma, 0.0])
        assert taken == [1.0, is_taken, 1.0]
        assert innovation[1] == pytest.approx(factor, rel=1e-6)
        assert (now[1] != 0.0) == bool(is_taken)
    assert readings_of(0.0, [np.inf, 1e3, np.nan])[0] == [0.0, 1.0, 0.0]


@pytest.mark.skipif(not shutil.which("arm-none-eabi-gcc"), reason="needs arm-none-eabi-gcc")
@pytest.mark.parametrize(("options", "most"), [(("-DWP_SINGLE",), 2048), ((), 4096)], ids=["float", "double"])
def test_no_call_takes_more_stack_than_the_page_says(library, tmp_path, options, most):
    """By the compiler's own count, along the deepest calls."""
    processor = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-O2", "-std=c99"]
    command = ["arm-none-eabi-gcc", *processor, *options, "-fno-math-errno", "-fcallgraph-info=su", "-c"]
    subprocess.run([*command, library / "src" / SOURCE_FILE, "-o", tmp_path / "part.o"], check=True)
    graph = (tmp_path / "part.ci").read_text()
    own = {name: int(size) for name, size in re.findall(r'node: \{ title: "([^"]+)" label: "[^"]*?(\d+) bytes', graph)}
    calls = re.findall(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', graph)

    def deepest(name):
        return own.get(name, 0) + max((deepest(called) for caller, called in calls if caller == name), default=0)

    assert 1000 < max(map(deepest, own)) < most
