"""The Typer application that the command modules fill."""

from __future__ import annotations

import typer

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Find out what the model of a wheel-driven inverted pendulum is missing.",
)
