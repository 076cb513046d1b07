"""What is compiled on first use is compiled once per machine, and is announced."""

import os
import py_compile
import re
import sys
from functools import partial
from importlib.util import cache_from_source
from pathlib import Path

import pytest
from numba import float64
from numba.core.dispatcher import Dispatcher

from tests.support import simulated
from wheelpend import Model, compare, identify
from wheelpend.kernels import cache, compilers
from wheelpend.kernels import load as kernels
from wheelpend.kernels.compile_worker import CompileRequest
from wheelpend.kernels.every_kernel import call_every_kernel
from wheelpend.kernels.first_use import COMPILING_NOTICE, first_use_notice
from wheelpend.kernels.kernel_module import KERNEL_MODULE_PREFIX
from wheelpend.model.precompile import compile_modules

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
        for name in [n for n in sys.modules if n.startswith(f"{KERNEL_MODULE_PREFIX}tiny")]:
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


def emptied(file: Path, other: Path) -> None:
    file.write_bytes(b"")


def halved(file: Path, other: Path) -> None:
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def changed(file: Path, other: Path) -> None:
    data = file.read_bytes()
    file.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))


def exchanged(file: Path, other: Path) -> None:
    file.write_bytes(other.read_bytes())


def opened(file: Path, other: Path) -> None:
    file.chmod(0o666)


DAMAGES = (emptied, halved, changed, exchanged, opened)


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("kind", ["kernel", "bytecode"])
def test_machine_code_and_bytecode_that_are_not_what_was_written_are_made_again(
    machine, fresh_compiler, tmp_path, capsys, kind, damage
):
    module = machine()
    module.twice(1.0), module.thrice(1.0)
    first = next((tmp_path / "wheelpend").rglob(f"*.{kind}"))
    damage(first, next(p for p in (tmp_path / "wheelpend").rglob("*.kernel") if p != first))
    capsys.readouterr()
    again = machine()
    assert (again.twice(1.0), again.thrice(1.0)) == (2.0, 3.0)
    said = [line for line in capsys.readouterr().err.splitlines() if line != COMPILING_NOTICE]
    assert said == [f"Files in {first.parent} are not what was written there, and are made again."]
    machine().twice(1.0), machine().thrice(1.0)
    assert capsys.readouterr().err == ""  # they are whole again


@pytest.mark.parametrize("damage", (emptied, halved, changed, exchanged))
def test_the_text_of_a_module_that_is_not_what_was_derived_is_written_again(machine, tmp_path, capsys, damage):
    text = Path(machine().__file__)
    damage(text, Path(__file__))
    capsys.readouterr()
    assert machine().twice(1.0) == 2.0 and text.read_text() == KERNEL
    assert capsys.readouterr().err.count("are made again") == 1


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_derived_text_that_is_not_what_was_written_is_derived_again(tmp_path, monkeypatch, capsys, damage):
    monkeypatch.setenv("WHEELPEND_CACHE", str(tmp_path))

    def kept(depends_on: str) -> str:
        monkeypatch.setattr(cache, "_texts_in_memory", {})  # as in a new process
        return cache.cached_text("derived", "slide", depends_on, lambda: f"text of {depends_on}")

    assert [kept("one"), kept("two")] == ["text of one", "text of two"]
    files = sorted((tmp_path / "wheelpend").glob("*.text"))
    damage(*files)
    first_use_notice().printed.clear()
    assert [kept("one"), kept("two"), kept("one")] == ["text of one", "text of two", "text of one"]
    assert capsys.readouterr().err.count("are made again") == 1


def test_bytecode_next_to_a_modules_text_is_not_run(machine, tmp_path):
    path, evil = Path(machine().__file__), tmp_path / "evil.py"
    evil.write_text("raise SystemExit('ran')")
    unchecked = py_compile.PycInvalidationMode.UNCHECKED_HASH
    py_compile.compile(str(evil), cfile=cache_from_source(str(path)), invalidation_mode=unchecked)
    assert machine().twice(1.0) == 2.0


@pytest.fixture()
def fresh_compiler():
    """No process that compiles, before a test and after it."""

    def forget():
        compilers.one_compiler().end()
        compilers.one_compiler.cache_clear()

    forget()
    yield compilers.one_compiler
    forget()


def test_this_process_loads_what_another_compiled(machine, fresh_compiler):
    module = machine()
    assert (module.twice(1.0), module.thrice(1.0)) == (2.0, 3.0)
    for kernel in (module.twice, module.thrice):
        assert sum(kernel.stats.cache_hits.values()) == 1 and not kernel.stats.cache_misses


@pytest.mark.parametrize("serve", ["raise SystemExit(3)", "print('Info: loaded', flush=True)"])
def test_where_no_other_process_can_it_compiles_itself(machine, fresh_compiler, monkeypatch, serve):
    monkeypatch.setattr(compilers, "SERVING_CODE", serve)
    module = machine()
    assert module.twice(1.0) == 2.0 and sum(module.twice.stats.cache_misses.values()) == 1
    assert module.thrice(1.0) == 3.0 and fresh_compiler().current is None


@pytest.mark.parametrize("program", ["", "/usr/bin/blender"])
def test_a_program_that_is_no_python_is_not_started_again(machine, fresh_compiler, monkeypatch, program):
    monkeypatch.setattr(sys, "executable", program)
    module = machine()
    assert module.twice(1.0) == 2.0 and not fresh_compiler().is_usable
    request = CompileRequest(module.__name__, module.__file__, "thrice", (float64,))
    assert list(compilers.compile_at_once([request])) == [(request, None)]


def test_an_interrupted_process_that_compiles_is_ended(machine, fresh_compiler, monkeypatch):
    def interrupted(compiler):
        raise KeyboardInterrupt

    module = machine()
    module.thrice(1.0)
    process = fresh_compiler().current._process
    monkeypatch.setattr(compilers.Compiler, "answer", interrupted)
    with pytest.raises(KeyboardInterrupt):
        module.twice(1.0)
    assert process.poll() is not None


@pytest.mark.parametrize("sent", [b"", b"\x80\x05\x95"])
def test_the_process_that_compiles_ends_with_the_one_that_asks(sent):
    compiler = compilers.Compiler()
    try:
        compiler._process.stdin.write(sent)  # killed in the midst of a request
        compiler._process.stdin.close()
        assert compiler._process.wait(timeout=20) == 0
    finally:
        compiler.end()


def test_a_forked_process_has_a_compiler_of_its_own(fresh_compiler):
    own = fresh_compiler()
    child = os.fork()
    if child == 0:
        os._exit(0 if fresh_compiler() is not own else 1)
    assert os.waitpid(child, 0)[1] == 0 and fresh_compiler() is own


def test_several_kernels_are_compiled_at_once_and_it_is_known_which_were_there(machine, monkeypatch):
    module = machine()
    signature = (float64,)
    twice, thrice, none = (
        CompileRequest(module.__name__, module.__file__, n, signature) for n in ("twice", "thrice", "x")
    )
    assert list(compilers.compile_at_once([twice])) == [(twice, True)]
    assert dict(compilers.compile_at_once([twice, thrice, none])) == {twice: False, thrice: True, none: None}
    machine().thrice(1.0)
    monkeypatch.setattr(compilers, "SERVING_CODE", "raise SystemExit(3)")
    assert dict(compilers.compile_at_once([twice, thrice])) == {twice: None, thrice: None}


@pytest.mark.slow
def test_warm_knows_what_it_compiled_and_what_was_there(tmp_path, monkeypatch):
    monkeypatch.setenv("WHEELPEND_CACHE", str(tmp_path))
    monkeypatch.setattr(kernels, "load_module", kernels.load_module.__wrapped__)  # whatever other tests have loaded
    for name in [n for n in sys.modules if n.startswith(f"{KERNEL_MODULE_PREFIX}slide")]:
        monkeypatch.delitem(sys.modules, name)
    plain, dry = (partial(kernels.model_module, "slide", {}, effects) for effects in ((), ("coulomb_drive",)))
    told = []
    assert compile_modules({"plain": plain}, told.append) == ["plain"]
    assert compile_modules({"plain": plain, "dry": dry}, told.append) == ["dry"]
    counts = [re.sub(", about .* left", "", text.rpartition("(")[2]) for text in told]
    assert counts == [
        "1 of 1)",
        "1 of 2)",
        "2 of 2)",
    ]


def test_warm_compiles_everything_that_fitting_and_comparing_call(library):
    call_every_kernel(library)
    functions = {name: f for name, f in vars(library).items() if isinstance(f, Dispatcher)}
    compiled = {name: list(f.signatures) for name, f in functions.items()}
    log = simulated(duration=3.0)
    compare(identify(Model.default(), [log]).model, [log])
    assert {name: list(f.signatures) for name, f in functions.items()} == compiled
