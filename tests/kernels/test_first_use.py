"""What is compiled on first use is compiled once per machine, and is announced."""

import sys

import pytest
from numba.core.dispatcher import Dispatcher

from tests.support import simulated
from wheelpend import Model, compare, identify
from wheelpend.kernels import load as kernels
from wheelpend.kernels.first_use import COMPILING_NOTICE
from wheelpend.model.precompile import call_every_kernel, compile_modules

KERNEL = """from numba import njit

@njit(cache=True)
def twice(x):
    return 2.0 * x

@njit(cache=True)
def thrice(x):
    return 3.0 * x
"""


@pytest.fixture()
def machine(tmp_path, monkeypatch):
    """What a new process finds, on a machine where nothing was compiled before."""
    monkeypatch.setenv("WHEELPEND_CACHE", str(tmp_path))

    def begin():
        kernels.first_use_notice().printed.clear()
        kernels.first_use_notice().compiled.clear()
        for name in [n for n in sys.modules if n.startswith(f"{kernels.KERNEL_MODULE_PREFIX}tiny")]:
            monkeypatch.delitem(sys.modules, name)
        return kernels.load_module.__wrapped__(KERNEL, "tiny")  # what this process remembers a new one does not

    return begin


def test_the_first_run_says_once_that_kernels_are_compiled(machine, capsys):
    module = machine()
    assert capsys.readouterr().err == ""  # loading compiles nothing
    assert (module.twice(1.0), module.thrice(1.0)) == (2.0, 3.0)
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", COMPILING_NOTICE + "\n")


def test_later_runs_find_them_compiled_and_say_nothing(machine, capsys):
    machine().twice(1.0)
    capsys.readouterr()
    machine().twice(1.0)
    assert capsys.readouterr().err == ""


def test_warm_knows_what_it_compiled_and_what_was_there(machine, monkeypatch):
    monkeypatch.setattr("wheelpend.model.precompile.call_every_kernel", lambda module: module.twice(1.0))
    assert compile_modules({"tiny": machine}, lambda text: None) == ["tiny"]
    assert compile_modules({"tiny": machine}, lambda text: None) == []


def test_warm_compiles_everything_that_fitting_and_comparing_call(library):
    call_every_kernel(library)
    functions = {name: f for name, f in vars(library).items() if isinstance(f, Dispatcher)}
    compiled = {name: list(f.signatures) for name, f in functions.items()}
    log = simulated(duration=3.0)
    compare(identify(Model.default(), [log]).model, [log])
    assert {name: list(f.signatures) for name, f in functions.items()} == compiled
