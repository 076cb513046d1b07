"""What makes the kernels fast stays: told by counts of operations and by generous ratios."""

import ast
import inspect
import re

import numpy as np

from tests.support import X, quickest, simulated
from wheelpend.estimation.parameters import kernel_parameters
from wheelpend.estimation.state_reconstruction import measured_states

PARAMETERS = np.array(list(X.values()))


def text_of(kernel) -> str:
    """The generated text of a function, without its docstring."""
    return re.sub(r'""".*?"""', "", inspect.getsource(kernel.py_func), flags=re.S)


def operations(kernel) -> int:
    """Operations of a generated function, as it says."""
    return int(re.search(r"(\d+) operations", inspect.getsource(kernel.py_func)).group(1))


def test_no_generated_name_has_two_meanings(lean, library):
    for module in (lean, library):
        bodies = ast.parse(inspect.getsource(module)).body
        assigned = [n.id for s in bodies if isinstance(s, ast.Assign) for t in s.targets for n in ast.walk(t)
                    if isinstance(n, ast.Name)]  # fmt: skip
        names = assigned + [s.name for s in bodies if isinstance(s, ast.FunctionDef)]
        assert len(names) > 50 and len(names) == len(set(names))


def test_a_step_takes_one_sine_pair_in_full_and_turns_it_three_times(lean):
    step = text_of(lean._plain_step)
    assert step.count("_sine_pair(") == 1 and step.count("_rotated_sines(") == 3 and "math." not in step
    assert operations(lean._free_motion) <= 45 and operations(lean._residual_jacobian) <= 30


def test_the_library_costs_no_more_than_its_effects_need(library):
    assert operations(library._free_motion) <= 190 and operations(library._residual_jacobian) <= 260
    assert "math.exp" not in text_of(library._free_motion)  # dry friction is computed where there is any


def test_machines_side_by_side_take_a_fraction_of_the_time_of_each_alone(lean):
    t = np.arange(501) * 1e-3
    rest, noise, quantum = np.zeros(t.size), np.zeros((t.size, 3)), np.zeros(3)
    gains, record = np.tile([-168.0, -800.0, -8.8], (64, 1)), np.zeros((6, 5, 64))
    many = np.tile(PARAMETERS, (64, 1))

    def one():
        for _ in range(16):
            lean.closed_loop(t, rest, rest, gains[0], np.zeros(4), PARAMETERS, noise, quantum, 1e-3)

    def crowd():
        lean.closed_loop_batch(t, rest, rest, gains, np.zeros((64, 4)), many, 1e-3, 100, record)

    one(), crowd()
    assert quickest(crowd) < 2.0 * quickest(one)  # 64 against 16, so more than twice as fast each
    assert "math." not in text_of(lean._batch_step)


def test_kernels_let_other_threads_run(lean, library):
    assert lean.options["nogil"] and library.options["nogil"]


def test_few_signals_are_filtered_and_few_products_formed(lean):
    assert lean.SIGNALS <= 9 and lean.FEATURES <= 8


def test_a_gram_of_blocks_is_faster_than_one_of_rows(lean):
    log = simulated(duration=20.0)
    states, own = measured_states(lean, log), (PARAMETERS, 0.14, 0.18, True)
    memory, gram = lean.filter_memory(), np.zeros((8, 8))

    def rows():
        sides, phi = lean.filter_regressor(log.t, states, log.voltage, *own, states[0])
        matrix = np.concatenate([phi, sides[:, :, None]], axis=2).reshape(-1, 8)
        return matrix.T @ matrix

    def blocks():
        lean.filtered_gram(log.t, states, log.voltage, *own, memory, gram)

    rows(), blocks()
    assert quickest(blocks) < 0.5 * quickest(rows)


def test_a_recursive_update_has_no_loop(lean):
    update = text_of(lean.recursive_update)
    assert "for " not in update and update.count("/") <= 3  # a division takes as long as ten products


def test_sensitivities_to_everything_cost_few_simulations(library):
    log = simulated(duration=2.0)
    parameters = kernel_parameters(library, X, log)
    columns = np.arange(library.FITTED)

    def alone():
        library.simulate(log.t, log.voltage, np.zeros(4), parameters, 1e-3)

    def everything():
        library.sensitivities(log.t, log.voltage, np.zeros(4), parameters, columns, 1e-3)

    alone(), everything()
    assert quickest(everything) < 25.0 * quickest(alone)


def test_a_library_without_friction_in_its_parameters_takes_the_way_without_events(library):
    values = dict(zip(library.PARAMETERS, library.ABSENT, strict=True)) | X
    parameters = np.array([values[n] for n in library.PARAMETERS])
    assert library._is_frictionless.py_func(parameters)
    parameters[library.PARAMETERS.index("load_friction.share")] = 0.1
    assert not library._is_frictionless.py_func(parameters)
