"""wheelpend: find out what the model of a wheel-driven inverted pendulum is missing.

The public names are imported when they are first used, so that `import wheelpend` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOMES = {
    "Model": "model.record",
    "Log": "logs.log",
    "load_log": "logs.read",
    "save_log": "logs.read",
    "simulate": "simulation.simulate",
    "identify": "identification.identify",
    "residuals": "identification.residual_tests",
    "compare": "diagnosis.compare",
    "predict": "diagnosis.predict",
    "linearize": "simulation.linearize",
    "diagnose": "api",
    "explain": "api",
    "add": "diagnosis.change",
    "report": "reports.page.page",
    "plot": "reports.plots",
    "campaign": "campaigns.runner",
    "load_kernels": "model.model_kernels",
    "Failure": "errors",
}
_NAMES = {"report": "write_report"}

__all__ = sorted((*_HOMES, "__version__"))


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("wheelpend.version").version()
    if name not in _HOMES:
        raise AttributeError(f"module 'wheelpend' has no attribute '{name}'")
    return getattr(import_module(f"wheelpend.{_HOMES[name]}"), _NAMES.get(name, name))


def __dir__() -> list[str]:
    return __all__
