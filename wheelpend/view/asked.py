"""The words with which the workbench starts a process of its own: those of a command that judges, and --json."""

from __future__ import annotations

import argparse
from pathlib import Path

from wheelpend.model.record import Model
from wheelpend.model.user_plants import load_plant


def asked_of_files() -> argparse.Namespace:
    """The logs, those held out, the model and the file for the answer, as this process was asked."""
    return question_parser().parse_args()


def question_parser() -> argparse.ArgumentParser:
    """What reads these words."""
    parser = argparse.ArgumentParser()
    parser.add_argument("logs", nargs="*")
    parser.add_argument("--holdout", action="append", default=[])
    parser.add_argument("--model", default="model.toml")
    parser.add_argument("--plant")
    parser.add_argument("--json", required=True)
    return parser


def opened_model(asked: argparse.Namespace) -> Model:
    """The model that was named; its plant may be that of a file, named too."""
    if asked.plant:
        load_plant(Path(asked.plant))
    return Model.open(Path(asked.model))
