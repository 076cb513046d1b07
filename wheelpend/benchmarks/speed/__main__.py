"""``python -m wheelpend.benchmarks.speed``: measure, print and write the table."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from wheelpend.parallel import BLAS_THREAD_VARIABLES


def main(
    only: Annotated[list[str] | None, typer.Option(help="Only this row, such as loop; repeat.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the table here, in Markdown.")] = None,
    peers: Annotated[Path, typer.Option(help="Environment with other packages.")] = Path(".venv-peers"),
) -> None:
    """Measure how fast things are beside C and other packages."""
    # Before NumPy is imported, here and in every process started from here: hence the late imports.
    os.environ.update(dict.fromkeys(BLAS_THREAD_VARIABLES, "1"))
    from wheelpend.benchmarks.speed.page import table_text, write
    from wheelpend.benchmarks.speed.rows import measure, select_rows
    from wheelpend.benchmarks.speed.setting import Setting
    from wheelpend.reports.console import err, exit_on_failure, print_line

    with exit_on_failure():
        results = measure(select_rows(only or []), Setting(peers), lambda line: err.print(line, markup=False))
        print_line(table_text(results))
        if out:
            write(out, results)


if __name__ == "__main__":
    typer.run(main)
