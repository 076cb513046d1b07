"""The commands whose results are kept: chains of steps, each chain in a workspace of its own.

Every workspace has the logs of LOGS in its folder `logs`. They are short: what is pinned is that nothing changes, not
how good an answer is.
"""

from __future__ import annotations

from typing import NamedTuple

API = """
import numpy as np
from wheelpend import Model, add, compare, diagnose, explain, identify, load_kernels, load_log, report, simulate

model = Model.open("model.toml")
print(compare(model, ["logs/demo8.csv"], ["logs/holdout4.csv"]).error)
print({name: found.to_json() for name, found in identify(model, ["logs/demo8.csv"]).parameters.items()})
found = diagnose(model, ["logs/demo8.csv"])
print(found.verdict, found.candidates[0].effect, found.candidates[0].coefficients)
explanation = explain(model, ["logs/demo8.csv"])
print([(step.effect, step.error_before, step.error_after) for step in explanation.steps])
change = add(model, "coulomb_drive", ["logs/demo8.csv"])
print(change.model.effects, change.step.error_before, change.step.error_after)
report(explanation, "page.html")
print(load_log("logs/holdout4.csv").t[:3], simulate(model, duration=1.0, seed=3).t[-1])
kernels = load_kernels(".")
values = dict(X1=0.0436, X2=0.0178, X3=0.1149, X4=0.8719, X5=4.6701, X6=0.7268, X7=0.7256)
parameters = np.array([values[name] for name in kernels.PARAMETERS])
print(kernels.acceleration(0.0, np.array([0.0, 0.05, 0.0, 0.0]), 1.0, parameters))
print(kernels.simulate(np.arange(501) * 1e-3, np.zeros(501), np.array([0.0, 0.05, 0.0, 0.0]), parameters, 1e-3)[-1])
"""


class Cut(NamedTuple):
    """A log of a workspace: the first rows of a shipped one."""

    source: str  # in data/
    rows: int
    gap: tuple[int, int] = (0, 0)  # rows left out
    flipped: str = ""  # a column whose sign is turned


class Edit(NamedTuple):
    """A change made by hand before a command: the first place where ``old`` stands in a file becomes ``new``."""

    file: str
    old: str
    new: str


class Step(NamedTuple):
    """One command, or a script, and what it leaves."""

    name: str
    arguments: tuple[str, ...]  # after `python -m wheelpend`
    json: bool = False  # the command takes --json
    files: tuple[str, ...] = ()  # patterns of the files it writes
    edit: Edit | None = None
    script: str = ""  # instead of a command


class Chain(NamedTuple):
    """Commands one after the other in one workspace."""

    name: str
    steps: tuple[Step, ...]
    slow: bool = False  # not part of an ordinary test run


def step(name: str, line: str, *files: str, json: bool = False, edit: Edit | None = None) -> Step:
    """A command as it is typed."""
    return Step(name, tuple(line.split()), json, files, edit)


def asked(name: str, line: str, *files: str) -> Step:
    """A command that takes --json."""
    return step(name, line, *files, json=True)


LOGS = {
    "demo8.csv": Cut("demo.csv", 8000),
    "demo4.csv": Cut("demo.csv", 4000),
    "holdout4.csv": Cut("demo_holdout.csv", 4000),
    "engine_cogging.csv": Cut("engine_cogging.csv", 10001),
    "engine_friction_slope.csv": Cut("engine_friction_slope.csv", 10001),
    "engine_inductance.csv": Cut("engine_inductance.csv", 10001),
    "cogging4.csv": Cut("engine_cogging.csv", 4000),
    "slope4.csv": Cut("engine_friction_slope.csv", 4000),
    "inductance4.csv": Cut("engine_inductance.csv", 4000),
    "faulty.csv": Cut("engine_inductance.csv", 6000, gap=(2000, 2150), flipped="dtheta_p"),
}

NEW = step("new", "new", "model.toml", "generated/*.py")
BARE = step("new", "new")
SWITCH = Edit("model.toml", 'ground_friction_reaction = "body"', 'ground_friction_reaction = "none"')
FRICTION = Edit(
    "model.toml",
    "effects = []",
    'effects = ["coulomb_drive", "slope"]\n\n[effect.coulomb_drive]\n'
    "torque = { identified = 0.3, sigma = 0.006 }\n\n[effect.slope]\nangle = { identified = 0.02 }",
)

WARM = Chain("warm", (BARE, step("warm", "warm")), slow=True)

CHAINS = (
    WARM,
    Chain("new", (
        NEW,
        step("new_again", "new"),
        step("slide", "new slide --plant slide", "slide/model.toml", "slide/generated/*.py"),
        step("pendulum", "new pendulum --plant pendulum", "pendulum/model.toml", "pendulum/generated/*.py"),
        step("cart_pole", "new cart_pole --plant cart_pole", "cart_pole/model.toml", "cart_pole/generated/*.py"),
        step("no_such_plant", "new other --plant unicycle"),
    )),
    Chain("equations", (
        BARE,
        step("text", "equations"),
        step("latex", "equations --latex"),
        step("diff_choice", "equations --diff ground_friction_reaction=none"),
        step("diff_circuit", "equations --diff motor_circuit=dynamic"),
        step("diff_unknown", "equations --diff motor_circut=dynamic"),
        step("slide", "new slide --plant slide"),
        step("slide_text", "equations --model slide"),
        step("diff_file", "equations --diff slide/model.toml"),
    )),
    Chain("verify", (asked("verify", "verify --page paper.md", "paper.md"),)),
    Chain("generate", (
        BARE,
        step("check", "generate --check"),
        step("stale", "generate --check", edit=SWITCH),
        step("generate", "generate", "generated/*.py"),
        step("check_again", "generate --check"),
        step("set", "set columns.theta_p.sign=-1 columns.theta_p.unit=deg sensors.encoder=relative", "model.toml",
             "generated/*.py"),
        step("set_wrong", "set columns.theta_p.sign=2", "model.toml"),
        step("turning", "generate", "generated/*.py", edit=Edit("model.toml", "planar = true", "planar = false")),
    )),
    Chain("effects", (
        step("library", "effects", json=True),
        asked("one", "effects cogging"),
        asked("unknown", "effects columb_drive"),
        step("slide", "new slide --plant slide"),
        asked("of_the_slide", "effects --model slide"),
    )),
    Chain("simulate", (
        BARE,
        step("friction", "simulate -o a.csv --duration 8 --seed 1 --hide coulomb_drive=0.3", "a.csv"),
        step("two_effects", "simulate -o b.csv --command simple --duration 4 --seed 2 --hide actuator_delay=0.004 "
             "--hide cogging=sine:0.2,cosine:0.1,periods:12", "b.csv"),
        step("no_noise", "simulate -o c.csv --duration 4 --no-noise", "c.csv"),
        step("unknown_effect", "simulate -o d.csv --hide columb_drive=0.3"),
    )),
    Chain("identify", (
        BARE,
        asked("shooting", "identify logs/demo4.csv logs/holdout4.csv --method shooting"),
        asked("iv", "identify logs/demo4.csv --method iv"),
        asked("filtered", "identify logs/demo4.csv --method filtered --tau 0.5,1 --hold zero"),
        asked("recursive", "identify logs/demo4.csv --method recursive --forgetting 0.9999 --hold first"),
        asked("energy", "identify logs/demo4.csv --method energy --tau 5"),
        asked("inverse", "identify logs/demo4.csv --method inverse"),
        asked("differentiation", "identify logs/demo4.csv --method differentiation"),
        asked("unknown_method", "identify logs/demo4.csv --method guess"),
    )),
    Chain("identify_save", (BARE, asked("save", "identify logs/demo4.csv --save", "model.toml")), slow=True),
    Chain("identify_long", (
        BARE,
        asked("auto", "identify logs/demo8.csv --method filtered --tau auto --tau-map taus.png", "taus.png"),
        asked("recursive", "identify logs/demo8.csv --method recursive"),
        asked("energy", "identify logs/demo8.csv --method energy"),
        asked("iv_auto", "identify logs/demo8.csv --method iv --tau auto"),
    ), slow=True),
    Chain("compare", (
        BARE,
        asked("log", "compare logs/demo4.csv"),
        asked("residuals", "residuals logs/demo4.csv"),
        asked("holdout", "compare logs/demo4.csv --holdout logs/holdout4.csv"),
        asked("both_sides", "compare logs/demo4.csv --holdout logs/demo4.csv"),
    )),
    Chain("inspect", (
        BARE,
        asked("demo", "inspect logs/demo8.csv"),
        asked("engine", "inspect logs/engine_cogging.csv"),
        asked("faulty", "inspect logs/faulty.csv"),
        asked("absent", "inspect logs/nowhere.csv"),
        step("usage", "inspect"),
        asked("split", "split logs/demo4.csv --from 1 --to 1.05", "demo4_1-1.05s.csv"),
        asked("split_nothing", "split logs/demo4.csv --from 3 --to 2"),
    )),
    Chain("first_look", (
        asked("inspect", "inspect logs/demo8.csv"),
        step("new_from", "new found --from logs/demo8.csv", "found/model.toml"),
        step("nothing_moves", "new other --from logs/nowhere.csv"),
    )),
    Chain("change", (
        BARE,
        asked("empty_history", "history"),
        asked("add", "add coulomb_drive --data logs/demo4.csv --holdout logs/holdout4.csv", "model.toml",
              "generated/*.py"),
        asked("remove", "remove coulomb_drive --data logs/demo4.csv", "model.toml"),
        asked("history", "history", "history.json"),
        asked("add_unknown", "add columb_drive"),
        asked("add_derived_only", "add slope", "model.toml"),
    )),
    Chain("demo", (
        step("demo", "demo --out demo", "demo/model.toml", "demo/history.json", "demo/report.html",
             "demo/error_ladder.svg", "demo/generated/*.py"),
        asked("history", "history --model demo"),
    ), slow=True),
    Chain("diagnose", (
        BARE,
        asked("holdout", "diagnose logs/demo8.csv --holdout logs/holdout4.csv"),
        asked("without", "diagnose logs/demo8.csv --without coulomb_drive"),
        asked("law", "diagnose logs/demo4.csv --without coulomb_drive --without stribeck_drive "
              "--without presliding_drive --law"),
    ), slow=True),
    Chain("explain_cogging", (BARE, asked("explain", "explain logs/engine_cogging.csv")), slow=True),
    Chain("explain_friction_slope", (BARE, asked("explain", "explain logs/engine_friction_slope.csv")), slow=True),
    Chain("explain_inductance", (BARE, asked("explain", "explain logs/engine_inductance.csv")), slow=True),
    Chain("explain_save", (
        BARE,
        asked("explain", "explain logs/demo8.csv --holdout logs/holdout4.csv --max-effects 1 --save", "model.toml",
              "history.json"),
        asked("history", "history"),
        step("check", "generate --check"),
        asked("compare", "compare logs/demo8.csv --holdout logs/holdout4.csv"),
        asked("design", "design -o next.csv --duration 5", "next.csv"),
        step("play", "simulate -o next_log.csv --command next.csv --seed 4", "next_log.csv"),
    ), slow=True),
    Chain("design", (
        BARE,
        asked("between", "design logs/demo4.csv --between slope,com_offset --pitch-limit 0.2 --voltage-limit 12 "
              "--duration 5", "designed.csv"),
    ), slow=True),
    Chain("report", (BARE, step("report", "report logs/demo8.csv -o report.html", "report.html")), slow=True),
    Chain("campaign", (
        BARE,
        asked("identify", "campaign logs/cogging4.csv logs/slope4.csv logs/inductance4.csv logs/nowhere.csv",
              "campaign.csv"),
        asked("compare", "campaign logs/cogging4.csv logs/slope4.csv --do compare --out c.csv", "c.csv"),
        asked("diagnose", "campaign logs/cogging4.csv logs/demo4.csv --do diagnose --out d.csv", "d.csv"),
        asked("simulated", "campaign --simulate --seeds 3 --duration 4 --hide coulomb_drive=0.3 --out s.csv", "s.csv"),
        asked("filtered", "campaign logs/demo4.csv logs/cogging4.csv logs/slope4.csv --method filtered --tau 0.5,1 "
              "--out f.csv", "f.csv"),  # three: of two logs neither is the one furthest off
    ), slow=True),
    Chain("export", (
        BARE,
        step("c", "export c -o c", "c/EXPORT.md", json=True, edit=FRICTION),
        asked("js", "export js -o js"),
        asked("mujoco", "export mujoco -o mujoco", "mujoco/*.xml"),
        asked("json", "export json -o json", "json/model.json"),
    ), slow=True),
    Chain("slide", (
        step("new", "new . --plant slide"),
        step("simulate", "simulate -o a.csv --duration 4 --seed 1 --hide coulomb_drive=0.3", "a.csv"),
        asked("inspect", "inspect a.csv"),
        asked("identify", "identify a.csv"),
        asked("compare", "compare a.csv"),
        asked("explain", "explain a.csv"),
    ), slow=True),
    Chain("pendulum", (
        step("new", "new . --plant pendulum"),
        step("simulate", "simulate -o a.csv --duration 4 --seed 1", "a.csv"),
        asked("identify", "identify a.csv"),
        asked("compare", "compare a.csv"),
    ), slow=True),
    Chain("reproduce", (
        asked("all", "reproduce all --seeds 2 --out paper", "paper/*.csv", "paper/*.png", "paper/gallery.html"),
    ), slow=True),
    Chain("python", (BARE, Step("api", (), files=("page.html",), script=API)), slow=True),
)  # fmt: skip
