"""Ahead-of-time compilation of the kernels that the commands use."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import derive
from wheelpend.durations import StepTimer
from wheelpend.kernels.compile_worker import CompileRequest
from wheelpend.kernels.compilers import compile_at_once
from wheelpend.kernels.every_kernel import call_every_kernel
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import free_force_module, model_module
from wheelpend.model.model_kernels import library_module_of
from wheelpend.model.record import Model

FIT_MODULES = ("library", "plain plant with unknown forces", "model", "model with unknown forces")  # of a fit alone


def compile_all(model: Model, progress: Callable[[str], None]) -> list[str]:
    """Compile the model's own kernels and the library's, also those with an internal coordinate released.

    Returns the modules, by what they hold, of which something had to be compiled.
    """
    return compile_modules(module_loaders(model), progress)


def module_loaders(model: Model) -> dict[str, Callable[[], KernelModule]]:
    """Loaders of the modules that the tool uses of a model, by what they hold."""
    releasing = sorted(
        {e.releases: e.name for e in derive.effects.applicable_to(model.plant_signature) if e.releases}.items()
    )
    return {
        "library": partial(library_module_of, model),
        **{f"library with {name}": partial(library_module_of, model, [effect]) for name, effect in releasing},
        "plain plant": partial(model_module, model.plant, model.assumptions, ()),
        "plain plant with unknown forces": partial(free_force_module, model.plant, model.assumptions, ()),
        "model": partial(model_module, model.plant, model.assumptions, model.effects),
        "model with unknown forces": partial(free_force_module, model.plant, model.assumptions, model.effects),
    }


def compile_modules(modules: Mapping[str, Callable[[], KernelModule]], progress: Callable[[str], None]) -> list[str]:
    """Compile modules by name, several at once; returns those of which something had to be compiled.

    Raises what their kernels raise where they cannot be compiled or called.
    """
    loaded: dict[str, KernelModule] = {}  # by what they hold; a model without effects is the plain plant
    answers: dict[str, bool | None] = {}  # by module
    timer = StepTimer(len(modules))

    def requests() -> Iterator[CompileRequest]:
        asked: set[str] = set()
        for name, load in modules.items():
            loaded[name] = module = load()
            assert module.__file__, "a generated module is a file"
            count = f"{len(loaded)} of {len(modules)}{timer.left_text(len(answers))}"
            progress(f"compiling the kernels of the {name}, once per machine ({count})")
            if module.__name__ not in asked:
                asked.add(module.__name__)
                yield CompileRequest(module.__name__, module.__file__)

    for request, answer in compile_at_once(requests()):
        answers[request.module] = answer
    for module in {m.__name__: m for m in loaded.values()}.values():
        if answers[module.__name__] is None:
            call_every_kernel(module)
    return [name for name, module in loaded.items() if answers[module.__name__] is not False]
