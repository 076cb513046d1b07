"""The structure of the code in figures: ``python -m wheelpend.benchmarks.structure [FOLDER]``, or this checkout.

A room is a file or folder of ``wheelpend/``; ``derive/`` is one room. An arrow is a pair of rooms of which the first
imports something of the second; late imports and imports for types count. A room stands one floor above the highest
room that it imports; rooms that import each other in a circle share a floor, and a chain runs through each of them.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

CONSTANT_PATTERN = re.compile(r"_?[A-Z][A-Z0-9_]*")
PACKAGES = {"wheelpend": 2, "derive": 1}  # how many parts of a module's name tell its room
Graph = Mapping[str, set[str]]


class Structure(NamedTuple):
    """Figures of a checkout."""

    rooms: int
    floors: int
    arrows: int  # between rooms
    longest_chain: int  # of rooms, each of which imports the next
    files: int
    longest_file_chain: int  # of files, each of which imports the next
    constants: int  # names in capitals that a module of wheelpend/ assigns
    one_word_constants: int  # letters of the paper among them


def measure(folder: Path) -> Structure:
    """Structure of the packages ``wheelpend`` and ``derive`` below a folder."""
    trees = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in module_paths(folder)}
    files: Graph = {name: set(imports_of(tree, trees)) - {name} for name, tree in trees.items()}
    rooms = room_graph(files)
    constants = [c for name, tree in trees.items() if name.startswith("wheelpend") for c in constants_of(tree)]
    return Structure(
        rooms=len(rooms),
        floors=max(heights(rooms, weighted=False).values()),
        arrows=sum(map(len, rooms.values())),
        longest_chain=max(heights(rooms).values()),
        files=len(files),
        longest_file_chain=max(heights(files).values()),
        constants=len(constants),
        one_word_constants=sum("_" not in name.strip("_") for name in constants),
    )


def module_paths(folder: Path) -> Iterator[tuple[str, Path]]:
    """Dotted names and paths of all modules."""
    for package in PACKAGES:
        for path in sorted((folder / package).rglob("*.py")):
            parts = path.relative_to(folder).with_suffix("").parts
            yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def imports_of(tree: ast.Module, known: Container[str]) -> Iterator[str]:
    """Known modules that a module imports, wherever in it, or names in them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (m if m in known else node.module for m in modules if m in known or node.module in known)


def room_graph(files: Graph) -> Graph:
    """The files' imports as those of their rooms."""
    rooms: dict[str, set[str]] = {room_of(name): set() for name in files}
    for name, targets in files.items():
        rooms[room_of(name)] |= {room_of(t) for t in targets} - {room_of(name)}
    return rooms


def room_of(module: str) -> str:
    """Room in which a module lies."""
    parts = module.split(".")
    return ".".join(parts[: PACKAGES[parts[0]]])


def heights(graph: Graph, weighted: bool = True) -> dict[str, int]:
    """Number of nodes on the longest way down from each; a circle counts as many as it holds, or one."""
    circles = circles_of(graph)
    found: dict[str, int] = {}
    for circle in circles:  # what a circle imports comes before it
        below = [found[t] for name in circle for t in graph[name] if t not in circle]
        found |= dict.fromkeys(circle, max(below, default=0) + (len(circle) if weighted else 1))
    return found


def circles_of(graph: Graph) -> list[tuple[str, ...]]:
    """Strongly connected components, each after those that it leads to (Tarjan 1972)."""
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[tuple[str, ...]] = []

    def visit(node: str) -> None:
        index[node] = lowest[node] = len(index)
        stack.append(node)
        for target in sorted(graph[node]):
            if target not in index:
                visit(target)
            if target in stack:
                lowest[node] = min(lowest[node], lowest[target])
        if lowest[node] == index[node]:
            place = stack.index(node)
            found.append(tuple(stack[place:]))
            del stack[place:]

    for node in sorted(graph):
        if node not in index:
            visit(node)
    return found


def constants_of(tree: ast.Module) -> Iterator[str]:
    """Names in capitals that a module assigns at its top."""
    for statement in tree.body:
        targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        for target in targets:
            for name in ast.walk(target) if target else ():
                if isinstance(name, ast.Name) and CONSTANT_PATTERN.fullmatch(name.id):
                    yield name.id


def main() -> None:
    """Print the figures, one a line."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    for name, value in measure(folder)._asdict().items():
        print(f"{name.replace('_', ' '):20}{value:6}")


if __name__ == "__main__":
    main()
