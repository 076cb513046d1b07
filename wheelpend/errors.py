"""The one error that users meet: the data or the model cannot be used."""

from __future__ import annotations

import difflib
import importlib.util
from collections.abc import Iterable


class Failure(ValueError):
    """The data or the model cannot be used; the message says what must hold, what came and what to do."""


class OutOfRange(Failure):
    """A simulated machine leaves the range within which its range channel must stay."""


class NotSimulable(Failure):
    """No parameters were found with which the model can be simulated over the horizon."""


class TooShort(Failure):
    """A log, or what is held out of it, has no stretch as long as it is to be judged over."""


class BadCell(Failure):
    """A column of numbers has a few cells that are none."""


def require(package: str, extra: str, purpose: str) -> None:
    """Raise Failure where a package of an extra is not installed, which a purpose needs."""
    if importlib.util.find_spec(package) is None:
        raise Failure(
            f"{purpose} needs {package}, which is not installed. Install it with: pip install 'wheelpend[{extra}]'"
        )


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A closing sentence that names the closest known word, or nothing where none is close."""
    close = difflib.get_close_matches(name, list(known), 1)
    return f" Did you mean '{close[0]}'?" if close else ""
