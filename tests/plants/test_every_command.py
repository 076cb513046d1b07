"""Every command on every plant: it works, or it fails with a sentence that says what must hold.

And no text speaks of another plant: no wheel, robot or pitch on a carriage, no volt where the input is a current.
"""

from __future__ import annotations

import json
import re

import pytest

from tests.plants.machines import LEVER, LEVER_FILE, MACHINES, log_of, model_of, model_text
from tests.support import run
from wheelpend import save_log

FOREIGN = {"wheel", "wheels", "robot", "pitch", "gyro", "imu", "encoder_counts", "theta_w"}
OWN_WORDS = {  # the first plant may say them, and a machine with a gyro that it has one
    "wheel_pendulum": FOREIGN,
    "turning": FOREIGN,
    "driven second link": {"gyro"},
}
QUICK = ("slide", "cart_pole", LEVER)  # what is run with every test
METHODS = ("shooting", "filtered", "iv", "recursive", "energy", "inverse", "differentiation")


@pytest.fixture(scope="module")
def workspaces(tmp_path_factory):
    """A workspace of each machine, with a log of it; made when first asked for."""
    made = {}

    def workspace(machine):
        if machine not in made:
            folder = tmp_path_factory.mktemp(machine.replace(" ", "_"))
            (folder / "model.toml").write_text(model_text(machine))
            model, log = model_of(machine), log_of(machine)
            save_log(folder / "log.csv", log, table=model.table)
            made[machine] = folder
        return made[machine]

    return workspace


def called(machine, folder, *line, code=0):
    """Output of a command in a workspace, checked for the words of other plants."""
    plant = ["--plant", LEVER_FILE] if machine == LEVER and line[0] != "new" else []
    result = run(*line, *(["--model", folder / "model.toml"] if line[0] != "new" else []), *plant, code=code)
    text = result.stdout + result.stderr
    sent = re.sub(r"`wheelpend inspect[^`]*`|^Next, .*$", "", text, flags=re.MULTILINE)  # advised by warning or hint
    assert "Traceback" not in text and "wheelpend inspect" not in sent
    return checked(machine, text)


def checked(machine, text):
    """A text, in which no word of another plant stands."""
    said = set(re.findall(r"[a-z_]+", re.sub(r"wheelpend\w*|wheel_pendulum\w*", "", text.lower())))
    foreign = said & (FOREIGN - OWN_WORDS.get(machine, set()))
    assert not foreign, f"{foreign} in {text}"
    if model_of(machine).plant_signature.input_unit != "V":
        assert not re.search(r"(?<!-)\bvolt(s|age)?\b(?!-)", text.lower()), text
    return text


def each(machines=tuple(MACHINES)):
    """Machines as test parameters; those that are not quick are slow."""
    return [pytest.param(m, marks=() if m in QUICK else pytest.mark.slow) for m in machines]


@pytest.mark.parametrize("machine", each())
def test_a_workspace_of_every_plant_begins_and_prints_its_equations(machine, workspaces, tmp_path):
    name = LEVER_FILE if machine == LEVER else MACHINES[machine].plant
    run("new", tmp_path / "new", "--plant", name)
    folder = workspaces(machine)
    assert "row" in called(machine, folder, "equations")
    called(machine, folder, "generate")
    called(machine, folder, "generate", "--check")
    assert "coulomb_drive" in called(machine, folder, "effects")
    assert json.loads(called(machine, folder, "effects", "--json", "-"))["effects"]


@pytest.mark.parametrize("machine", each())
def test_every_plant_is_simulated_and_inspected(machine, workspaces, tmp_path):
    folder = workspaces(machine)
    called(machine, folder, "simulate", "-o", tmp_path / "again.csv", "--duration", "2")
    found = json.loads(called(machine, folder, "inspect", folder / "log.csv", "--json", "-"))
    assert {f["kind"] for f in found["findings"]} <= {"stand_still"}
    called(machine, folder, "inspect", folder / "log.csv")


@pytest.mark.parametrize("machine", each())
def test_every_method_identifies_or_says_why_not(machine, workspaces):
    folder, worked = workspaces(machine), []
    for method in METHODS if machine in ("slide",) else ("shooting", "filtered", "iv", "energy", "differentiation"):
        line = ("identify", folder / "log.csv", "--method", method, "--json", "-")
        result = run(*line, "--model", folder / "model.toml", *(["--plant", LEVER_FILE] if machine == LEVER else []),
                     code=None)  # fmt: skip
        checked(machine, result.stderr)
        answer = json.loads(result.stdout)
        assert result.exit_code == 0 or re.search(r"must|needs|Give|Use|takes", answer["failure"]), (method, answer)
        worked += [method] if result.exit_code == 0 else []
    assert {"shooting", "filtered"} <= set(worked)


@pytest.mark.slow
@pytest.mark.parametrize("machine", each())
def test_every_plant_is_compared(machine, workspaces):
    called(machine, workspaces(machine), "compare", workspaces(machine) / "log.csv")


@pytest.mark.slow
@pytest.mark.parametrize("machine", each((*QUICK, *(m for m in MACHINES if m not in QUICK))))
def test_an_effect_is_added_and_removed_on_every_plant(machine, workspaces, tmp_path):
    folder = tmp_path
    (folder / "model.toml").write_text(model_text(machine))
    log = workspaces(machine) / "log.csv"
    called(machine, folder, "add", "coulomb_drive", "--data", log)
    called(machine, folder, "remove", "coulomb_drive")
    assert "coulomb_drive" in called(machine, folder, "history")


@pytest.mark.slow
@pytest.mark.parametrize("machine", tuple(MACHINES))
def test_every_plant_is_diagnosed_explained_and_reported(machine, workspaces, tmp_path):
    folder = workspaces(machine)
    hidden = log_of(machine, coulomb_drive__torque=0.02 if "links" in machine or machine == "pendulum" else 0.3)
    save_log(tmp_path / "hidden.csv", hidden, table=model_of(machine).table)
    called(machine, folder, "diagnose", tmp_path / "hidden.csv")
    called(machine, folder, "explain", tmp_path / "hidden.csv", "--max-effects", "2")
    called(machine, folder, "report", tmp_path / "hidden.csv", "-o", tmp_path / "report.html")
    page = re.sub(r"<script.*?</script>|<style.*?</style>", "", (tmp_path / "report.html").read_text(), flags=re.DOTALL)
    checked(machine, page)
    called(machine, folder, "campaign", tmp_path / "hidden.csv", folder / "log.csv", "--out", tmp_path / "campaign")


@pytest.mark.parametrize("machine", each())
def test_a_command_is_designed_where_a_plant_is_held_upright_and_else_it_is_said_why_not(machine, workspaces, tmp_path):
    folder, plant = workspaces(machine), model_of(machine).plant_signature
    line = ["design", "-o", tmp_path / "designed.csv", "--duration", "4", "--sample", "0.01"]
    if not plant.range_channel or plant.further:
        assert "held upright" in called(machine, folder, *line, code=1)
        return
    if plant.usual_limits is None:
        assert "--voltage-limit" in called(machine, folder, *line, code=1)
        line += ["--voltage-limit", "60"]
    called(machine, folder, *line)
    called(machine, folder, "simulate", "-o", tmp_path / "log.csv", "--command", tmp_path / "designed.csv")
