"""Text folded to a width without breaking a word, a number with its unit, or a command that is to be copied."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence

from rich.cells import cell_len

NO_BREAK_SPACE = "\N{NO-BREAK SPACE}"  # stands for a space at which nothing may be folded
COMMAND_PATTERN = re.compile(r"`[^`]{1,60}`")
TIED_SPACES = re.compile(
    r"(?<=[±=×<>→]) | (?=[±=×<>])"  # around a sign
    r"|(?<=\d) (?=(?:[µmk]?(?:V|A|N|m|s|h|min|rad|Hz|kg|σ|%)(?!\w)|σ|%))"  # before a unit
    r"|(?<=\d) (?=of \d)|(?<=\d of) (?=\d)"  # within 5 of 8
    r"|(?<=[VN]) (?=(?:s|m)(?![a-z]))"  # within units such as V s²/rad and N m
)
FRAME_CELLS = 3  # of a table's column, lines and blanks beside it; a table has one more


def wrapped(text: str, width: int) -> str:
    """A line folded at blanks to a width; further lines begin two blanks further in than the first."""
    if cell_len(text) <= width:
        return text
    indent = " " * (len(text) - len(text.lstrip(" ")) + 2)
    return "\n".join(_lines(text, width, indent))


def _lines(text: str, width: int, indent: str) -> list[str]:
    tied = COMMAND_PATTERN.sub(lambda found: found[0].replace(" ", NO_BREAK_SPACE), text)
    folded = textwrap.wrap(
        TIED_SPACES.sub(NO_BREAK_SPACE, tied), max(width, len(indent) + 1), subsequent_indent=indent,
        break_long_words=False, break_on_hyphens=False, replace_whitespace=False,
    )  # fmt: skip
    return [line.replace(NO_BREAK_SPACE, " ") for line in folded]


def column_blocks(rows: Sequence[Sequence[str]], width: int) -> list[list[int]]:
    """Numbers of a table's columns, in as many blocks as are needed so that none breaks a word at a width.

    Each begins with the first column, which holds names; a further one that is too wide beside it stands alone.
    """
    words = [max(map(_longest_word, map(str, column))) for column in zip(*rows, strict=True)]
    blocks = [[0]]
    for number in range(1, len(words)):
        block = [*blocks[-1], number]
        if len(block) > 2 and sum(words[k] for k in block) > _room(len(block), width):
            blocks.append([0, number])
        else:
            blocks[-1] = block
    return blocks


def _room(columns: int, width: int) -> int:
    """Cells of a width that are left for what stands in so many columns."""
    return width - FRAME_CELLS * columns - 1


def folded_cells(rows: Sequence[Sequence[str]], width: int) -> list[list[str]]:
    """Cells of a table, heads included, folded so that it is at most as wide, as far as no word need be broken for it.

    Heads are folded before what stands below them; the first column, which holds names, only where there is no other
    way.
    """
    columns = [[str(cell) for cell in column] for column in zip(*rows, strict=True)]
    room = _room(len(columns), width)
    wanted = [max(map(cell_len, _split(column))) for column in columns]
    words = [max(map(_longest_word, column)) for column in columns]
    needed = [wanted[0], *words[1:]] if wanted[0] + sum(words[1:]) <= room else words
    bodies = [max(map(cell_len, [*_split(column[1:]), "" if k else column[0]])) for k, column in enumerate(columns)]
    below = list(map(max, words, bodies))  # as wide as it takes with heads folded alone
    needed = below if sum(below) <= room else needed
    if sum(wanted) <= room or sum(needed) > room:
        return [list(map(str, row)) for row in rows]
    widths = _shared(needed, wanted, room)
    return [[_folded_cell(str(cell), size) for cell, size in zip(row, widths, strict=True)] for row in rows]


def _split(cells: Sequence[str]) -> list[str]:
    return [line for cell in cells for line in cell.split("\n")]


def _longest_word(cell: str) -> int:
    return max((cell_len(word) for line in cell.split("\n") for word in _lines(line, 1, "")), default=0)


def _shared(needed: Sequence[int], wanted: Sequence[int], room: int) -> list[int]:
    """Widths between what words need and what lines want, what is left given to the narrowest first."""
    widths = list(needed)
    for _ in range(max(room - sum(needed), 0)):
        short = [k for k, size in enumerate(widths) if size < wanted[k]]
        if not short:
            break
        widths[min(short, key=lambda k: widths[k] / wanted[k])] += 1
    return widths


def _folded_cell(cell: str, width: int) -> str:
    return "\n".join(folded for line in cell.split("\n") for folded in _lines(line, width, "") or [""])
