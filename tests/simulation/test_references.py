"""A file is a command, and is refused where it cannot be one."""

import numpy as np
import pytest

from wheelpend import Failure
from wheelpend.simulation.references import reference, save_trajectory


def test_a_file_is_a_command_and_is_linear_between_its_rows(tmp_path):
    t = np.arange(0.0, 3.0, 0.1)
    save_trajectory(tmp_path / "c.csv", t, 0.1 * t, np.full_like(t, 0.1))
    angle, rate = reference(str(tmp_path / "c.csv"), np.array([0.05, 1.234]))
    assert angle == pytest.approx([0.005, 0.1234]) and rate == pytest.approx([0.1, 0.1])
    with pytest.raises(Failure, match=r"ends at 2\.9 s"):
        reference(str(tmp_path / "c.csv"), np.array([0.0, 5.0]))


def test_a_command_file_in_degrees_or_without_its_column_is_refused(tmp_path):
    t = np.arange(0.0, 3.0, 0.1)
    save_trajectory(tmp_path / "c.csv", t, 20.0 * t, t)
    with pytest.raises(Failure, match="Is it in degrees"):
        reference(str(tmp_path / "c.csv"), t)
    (tmp_path / "d.csv").write_text("t,pitch\n" + "".join(f"{x},0\n" for x in t))
    with pytest.raises(Failure, match="theta_ref is missing"):
        reference(str(tmp_path / "d.csv"), t)
    with pytest.raises(Failure, match="Known commands: aggressive"):
        reference("agressive", t)
