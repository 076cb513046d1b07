"""The Typer application that the command modules fill."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from wheelpend import interruption
from wheelpend.reports.console import err


class Commands(TyperGroup):
    """Commands that Ctrl-C ends in words, with one exit code."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        interruption.begin_command()
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            interruption.say_once(lambda text: err.print(text, markup=False))
            raise typer.Exit(interruption.EXIT_CODE) from None


app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _print_version(asked: bool) -> None:
    """Print the version, and end."""
    if asked:
        from wheelpend.version import version  # imported late: it reads the package's metadata

        typer.echo(f"wheelpend {version()}")
        raise typer.Exit


@app.callback()
def wheelpend(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version, and end.")
    ] = False,
) -> None:
    """Find out what the model of a wheel-driven inverted pendulum, or of another machine, is missing."""
