"""The one error that users meet: the data or the model cannot be used."""

from __future__ import annotations


class Failure(ValueError):
    """The data or the model cannot be used; the message says what must hold, what came and what to do."""
