"""What the pages say is typed: code blocks, command lines, and the output that they show."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import typer

from tests.support import ROOT
from wheelpend.cli.commands import app

COMMANDS = typer.main.get_command(app).commands  # by name

PAGES = (ROOT / "README.md", ROOT / "SECURITY.md", ROOT / "data" / "README.md", *sorted((ROOT / "docs").glob("*.md")))
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str  # empty where none is stated
    text: str
    heading: str  # under which it stands


class Typed(NamedTuple):
    """A command of a console block, with the lines of output that the page shows."""

    command: str
    shown: tuple[str, ...]
    heading: str


def blocks(text: str) -> Iterator[Block]:
    """The fenced blocks of a page, in order."""
    heading = ""
    for found in re.finditer(r"^## ([^\n]+)$|^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        if found[1]:
            heading = found[1]
        else:
            yield Block(found[2], found[3], heading)


def typed(block: Block) -> Iterator[Typed]:
    """The commands of a console block: lines after ``$``, each with what follows it."""
    for part in re.split(r"^\$ ", block.text, flags=re.MULTILINE)[1:]:
        command, *shown = part.splitlines()
        yield Typed(command, tuple(line for line in shown if line.strip()), block.heading)


def plain(line: str) -> str:
    """A line without differences in space."""
    return " ".join(line.split())


def as_pattern(line: str) -> re.Pattern[str]:
    """Lines of output that say the same as one that is shown, whatever the numbers, which are groups; … is anything."""
    parts = [re.escape(NUMBER.sub("\0", part)) for part in plain(line).split("…")]
    return re.compile(".*?".join(parts).replace("\0", f"({NUMBER.pattern})"))


def command_lines(text: str) -> Iterator[tuple[str, bool]]:
    """Every command line of wheelpend in a page, each with whether it is whole: in a block it is, in a sentence not."""
    joined = re.sub(r"\\\n\s*", "", text)
    for line in joined.splitlines():
        if found := re.match(r"(?:    |\$ )?(?:\S*/)?(wheelpend -{0,2}[a-z][^`]*)$", line):
            yield found[1], True
    for found in re.finditer(r"`(?:\S*/)?(wheelpend [^`\n]+)`", joined):
        yield found[1], False
    for found in re.finditer(rf"`((?:{'|'.join(COMMANDS)}) [^`\n]*--[^`\n]*)`", joined):
        yield f"wheelpend {found[1]}", False


def words_of(line: str) -> list[list[str]]:
    """The arguments of each command of wheelpend in a line, without its comment, as a shell gives them."""
    words = shlex.split(line, comments=True)
    commands: list[list[str]] = [[]]
    for word in words:
        if word in ("&&", "||", ";", "|"):
            commands.append([])
        else:
            commands[-1].append(word.rstrip(";"))
    return [c[1:] for c in commands if c and Path(c[0]).name == "wheelpend"]
