"""The Typer application that the command modules fill."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from wheelpend import interruption
from wheelpend.reports.console import err
from wheelpend.reports.inputs import note_logs
from wheelpend.reports.outputs import note_given

COMMAND_GROUPS = {  # in the order of the way of working
    "Begin": ("demo", "new", "inspect", "set", "split", "view"),
    "Compare, and see where it fails": ("identify", "compare", "residuals"),
    "Learn what is missing, and add it": ("diagnose", "add", "remove", "explain", "history", "report"),
    "More logs": ("design", "simulate", "campaign"),
    "The model and its code": ("effects", "equations", "generate", "warm", "export"),
    "The paper": ("verify", "reproduce"),
}


LOG_PARAMETERS = ("logs", "log", "data", "holdout")  # names of those that are measurement files, in every command


class Commands(TyperGroup):
    """Commands that Ctrl-C ends in words, with one exit code, listed as one works with them."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the list of commands, by COMMAND_GROUPS."""
        width = max(map(len, self.commands))
        for title, names in COMMAND_GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), self.commands[name].get_short_help_str(500)) for name in names])

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        interruption.begin_command()
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            interruption.say_once(lambda text: err.print(text, markup=False))
            raise typer.Exit(interruption.EXIT_CODE) from None


class Command(TyperCommand):
    """A command whose paths are known, so that it writes over none that it reads, and says at once which is missing."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        paths = {p.name: p for p in self.params if p.name == "json" or p.type.name == "path"}
        given = [(name, path) for name in paths for path in _as_list(ctx.params.get(name))]
        note_given([path for _, path in given])
        note_logs([path for name, path in given if name in LOG_PARAMETERS and ctx.command.name != "campaign"])
        try:
            return super().invoke(ctx)
        finally:
            note_logs([])


def _as_list(value: Any) -> list[str]:
    """One path, several, or none, as a list."""
    several = value if isinstance(value, (list, tuple)) else [value]
    return [str(path) for path in several if path is not None]


class Application(typer.Typer):
    """An application of such commands."""

    def command(self, *names: Any, **options: Any) -> Any:
        """Register a command."""
        return super().command(*names, **{"cls": Command} | options)


app = Application(
    cls=Commands,
    no_args_is_help=True,
    add_completion=True,
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
