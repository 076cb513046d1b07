"""Every command line that the pages show is one that the tool takes: command, options, and the names in it."""

import re
from types import SimpleNamespace

import pytest
import typer

import derive.effects
from derive import plants
from tests.pages import COMMANDS, PAGES, blocks, command_lines, words_of
from wheelpend import Failure
from wheelpend.campaigns.one_log import LOG_ANALYSES
from wheelpend.cli.commands import app
from wheelpend.cli.options import parse_tau
from wheelpend.identification.method_options import METHOD_NAMES
from wheelpend.reproduction.reproduce import REPRODUCTION_PARTS
from wheelpend.simulation.hidden import parse_hidden
from wheelpend.simulation.references import BUILT_IN_COMMANDS_DEG

GROUP = typer.main.get_command(app)
Refused = typer.BadParameter.__mro__[2]  # ClickException, of click or of what typer brings in its place
PLACEHOLDER = re.compile(r"[A-Z]+(\.\.\.)?|\.\.\.|NAME=\S+|T1,T2|F")  # what a page writes for what its reader has
EFFECTS = set(derive.effects.EFFECT_LIBRARY)


def parsed(words, whole=True):
    """Command and values of a command line, by the real parser; not whole, it may lack what is required or a value."""
    name, *rest = words
    if name.startswith("-"):  # an option of wheelpend itself
        if not any(name in p.opts for p in GROUP.params):
            raise Failure(f"no option {name}")
        return SimpleNamespace(name="", params={})
    if name not in COMMANDS:
        raise Failure(f"no command {name}")
    try:
        context = COMMANDS[name].make_context(name, rest)
    except Refused as refused:
        if whole or type(refused).__name__ not in ("MissingParameter", "BadOptionUsage"):
            raise
        return SimpleNamespace(name=name, params={})
    return SimpleNamespace(name=name, params=context.params)


def own_effects(text):
    """Effects that a page itself makes: sections of an effects.toml, and laws that it accepts under a name."""
    own = (b.text for b in blocks(text) if "family =" in b.text)
    tables = [name for toml in own for name in re.findall(r"^\[(\w+)\]", toml, re.M)]
    return {*tables, *re.findall(r"--accept (\w+)", text)}


def wrong_names(command, known):
    """What in a command line names nothing: effects, methods, plants, parts, tasks, sizes and times."""
    values = {k: v for k, v in command.params.items() if v is not None}
    named = values.get("effect") if command.name in ("add", "remove") else values.get("name")
    effects = [named, *(values.get("without") or ()), *(values.get("between") or "").split(",")]
    yield from (n for n in effects if n and n not in known and not PLACEHOLDER.fullmatch(n))
    chosen = {"method": METHOD_NAMES, "do": LOG_ANALYSES, "what": REPRODUCTION_PARTS}
    for key, choices in chosen.items():
        if key in values and values[key] not in choices:
            yield values[key]
    plant, played = str(values.get("plant") or ""), values.get("command")
    if plant and not (plant in plants.KNOWN_PLANTS or plant.endswith(".py") or PLACEHOLDER.fullmatch(plant)):
        yield plant
    if played and not (played in BUILT_IN_COMMANDS_DEG or played.endswith(".csv")):
        yield played
    for text in values.get("hide") or ():
        if text.partition("=")[0] in EFFECTS:
            parse_hidden([text])
        elif not PLACEHOLDER.fullmatch(text) and text.partition("=")[0] not in known:
            yield text
    if values.get("tau") and not PLACEHOLDER.fullmatch(values["tau"]):
        parse_tau(values["tau"])


def faults_of(text):
    """Command lines of a page that the tool would refuse, each with why."""
    known = EFFECTS | own_effects(text)
    for line, whole in command_lines(text):
        for words in words_of(line):
            if PLACEHOLDER.fullmatch(words[0]):
                continue
            try:
                wrong = list(wrong_names(parsed(words, whole), known))
            except (Refused, Failure) as refused:
                wrong = [str(refused) or type(refused).__name__]
            if wrong:
                yield f"{line}: {', '.join(wrong)}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_command_line_of_a_page_is_one_that_the_tool_takes(page):
    assert not list(faults_of(page.read_text(encoding="utf-8")))


def test_command_lines_are_found_at_all():
    found = [line for page in PAGES for line in command_lines(page.read_text(encoding="utf-8"))]
    assert len(found) > 150
    commands = {words[0] for line, _ in found for words in words_of(line)}
    assert set(COMMANDS) <= commands, f"no page shows {set(COMMANDS) - commands}"


@pytest.mark.parametrize(
    "line",
    [
        "    wheelpend compair drive1.csv",
        "    wheelpend compare drive1.csv --hold-out drive2.csv",
        "    wheelpend compare",
        "    wheelpend add columb_drive drive1.csv",
        "    wheelpend diagnose drive1.csv --without columb_drive",
        "    wheelpend design drive1.csv --between slope,columb_drive",
        "    wheelpend identify drive1.csv --method filtred",
        "    wheelpend identify drive1.csv --tau auto,5",
        "    wheelpend simulate -o log.csv --hide cogging=sine:0.2",
        "    wheelpend simulate -o log.csv --command agressive",
        "    wheelpend new axis --plant slyde",
        "    wheelpend campaign drive1.csv --do diagnosis",
        "    wheelpend reproduce table4",
        "    wheelpend --verson",
        "as `identify --taus auto` does",
        "```console\n$ wheelpend diagnose drive1.csv --wtihout slope\n```",
    ],
)
def test_a_command_line_that_the_tool_refuses_is_noticed(line):
    assert list(faults_of(line))


def test_an_effect_that_the_page_makes_is_known_there():
    line = "    wheelpend add rubbing drive1.csv\n"
    assert list(faults_of(line))
    assert not list(faults_of(line + '\n```toml\n[rubbing]\nfamily = "drive"\n```\n'))
