"""`wheelpend identify`: how its options must look."""

import pytest
from typer.testing import CliRunner

from tests.support import simulated
from wheelpend.cli.commands import app
from wheelpend.logs.read import save_log


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--tau", "fast"], "--tau must be times in s such as 0.14,0.14, or auto, not 'fast'"),
        (["--tau", "0.1,-2"], "--tau must be positive times in s"),
        (["--tau-map", "map.png"], "--tau-map draws what --tau auto finds, but --tau is not given"),
    ],
)
def test_the_command_line_says_how_time_constants_must_look(tmp_path, options, message):
    save_log(tmp_path / "log.csv", simulated(duration=1.0))
    result = CliRunner().invoke(app, ["identify", str(tmp_path / "log.csv"), "--method", "filtered", *options])
    assert result.exit_code == 1 and message in result.stderr.replace("\n", " ")
