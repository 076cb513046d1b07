"""A pendulum's bob that a camera saw: its x and y are one angle."""

import numpy as np
import pytest

from wheelpend import Failure
from wheelpend.inspection.camera_path import find_arc
from wheelpend.inspection.first_look import first_look

T = np.arange(0.0, 12.0, 1.0 / 30.0)
ANGLE = 0.6 * np.exp(-0.05 * T) * np.cos(3.9 * T)


def bob(down=1.0, noise=0.0015, pivot=(0.12, 0.9)):
    rng = np.random.default_rng(1)
    x, y = pivot[0] + 0.62 * np.sin(ANGLE), pivot[1] + down * 0.62 * np.cos(ANGLE)
    return x + rng.normal(0.0, noise, len(T)), y + rng.normal(0.0, noise, len(T))


@pytest.mark.parametrize("down", [1.0, -1.0])
def test_the_pivot_is_found_whichever_way_the_image_counts(down):
    arc = find_arc(*bob(down))
    assert (arc.x, arc.y, arc.radius) == pytest.approx((0.12, 0.9, 0.62), abs=0.01)
    assert arc.grows_downward == (down > 0.0)


@pytest.mark.parametrize(
    ("x", "y"),
    [
        (ANGLE, 0.3 * ANGLE + 1e-3 * np.sin(40.0 * T)),  # a normal mode of two links
        (np.sin(3.0 * T), np.cos(3.0 * T)),  # round and round
        (np.sin(2.5 * np.sin(T)), np.cos(2.5 * np.sin(T))),  # nearly so
        (np.sin(3.0 * T), np.sin(4.1 * T)),
        (np.full(len(T), np.nan), ANGLE),
        (ANGLE, np.zeros(len(T))),
    ],
)
def test_other_motions_are_no_arc(x, y):
    assert find_arc(x, y) is None


def test_small_swings_lost_frames_and_the_other_order_are_seen_through(tmp_path):
    x, y = bob(-1.0, noise=0.0008)
    small = 0.12 + 0.62 * np.sin(0.3 * ANGLE) + (x - x), 0.9 - 0.62 * np.cos(0.3 * ANGLE)
    rng = np.random.default_rng(2)
    assert find_arc(*(v + rng.normal(0.0, 0.0008, len(T)) for v in small)).radius == pytest.approx(0.62, abs=0.1)
    x[100], y[100] = 0.0, 0.0
    assert find_arc(x, y).radius == pytest.approx(0.62, abs=0.01)
    rows = "\n".join(f"{a:.4f},{c:.5f},{b:.5f}" for a, b, c in zip(T, x, y, strict=True))
    (tmp_path / "track.csv").write_text(f"t,y,x\n{rows}\n")
    with pytest.raises(Failure, match=r"theta_1 = atan2\(x - 0\.1\d*, 0\.\d* - y\)"):
        first_look(tmp_path / "track.csv")
    assert "links = 2" in first_look(tmp_path / "track.csv", "pendulum").model


def test_a_log_of_a_bob_is_refused_with_the_angle_to_write(tmp_path):
    x, y = bob(-1.0)
    rows = "\n".join(f"{a:.4f},{b:.5f},{c:.5f}" for a, b, c in zip(T, x, y, strict=True))
    (tmp_path / "track.csv").write_text(f"t,x,y\n{rows}\n")
    with pytest.raises(Failure, match=r"one angle of a pendulum.*theta_1 = atan2\(x - 0\.1\d*, 0\.\d* - y\)"):
        first_look(tmp_path / "track.csv")
