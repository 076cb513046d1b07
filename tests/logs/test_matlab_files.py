"""MATLAB files, read and refused."""

import numpy as np
import pytest
from scipy.io import savemat

from wheelpend import Failure, Model
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.read import load_log
from wheelpend.logs.tables import open_table


def test_a_matlab_file_is_read_with_its_structures_and_the_columns_of_its_matrices(tmp_path):
    rng = np.random.default_rng(3)
    q = np.column_stack([np.cumsum(rng.normal(size=300)), np.cumsum(rng.normal(size=300))])
    savemat(
        tmp_path / "log.mat", {"run": {"time": np.arange(300) * 0.01, "u": rng.normal(size=300)}, "q": q, "Ts": 0.01}
    )
    columns = {"t": ColumnMap("run.time"), "v_in": ColumnMap("run.u", scale=2.0), "x": ColumnMap("q[2]", "mm")}
    log = load_log(tmp_path / "log.mat", columns, Model.default("slide").table)
    np.testing.assert_allclose(log.measured[:, 0], 1e-3 * q[:, 1])
    assert len(log) == 300 and log.dt == pytest.approx(0.01)


@pytest.mark.parametrize(
    "content", [b"MATLAB 5.0 MAT-file" + b"\0" * 200, b"MATLAB 5.0 MAT-file, made" + bytes(range(256))]
)
def test_a_damaged_matlab_file_is_refused(tmp_path, content):
    (tmp_path / "log.mat").write_bytes(content)
    with pytest.raises(Failure, match=r"damaged|must hold numeric vectors"):
        load_log(tmp_path / "log.mat")


def test_a_matlab_file_without_vectors_is_refused(tmp_path):
    savemat(tmp_path / "log.mat", {"gain": 3.0, "name": "robot"})
    with pytest.raises(Failure, match="must hold numeric vectors"):
        load_log(tmp_path / "log.mat")


def test_a_complex_column_is_refused_by_name_and_one_that_is_not_needed_is_left_alone(tmp_path):
    rng = np.random.default_rng(3)
    table = {"t": np.arange(300) * 0.01, "v_in": rng.normal(size=300), "x": np.cumsum(rng.normal(size=300))}
    savemat(tmp_path / "log.mat", {**table, "spectrum": np.fft.fft(table["x"])})
    assert len(load_log(tmp_path / "log.mat", {}, Model.default("slide").table)) == 300
    savemat(tmp_path / "log.mat", {**table, "x": table["x"] * (1.0 + 1.0j)})
    with pytest.raises(Failure, match="x must hold real numbers, but it is complex"):
        load_log(tmp_path / "log.mat", {}, Model.default("slide").table)


@pytest.mark.parametrize("place", range(140, 400, 20))
def test_a_matlab_file_with_a_changed_byte_is_read_or_refused(place, tmp_path):
    path = tmp_path / "log.mat"
    savemat(path, {"t": np.arange(500.0), "v": np.sin(np.arange(500.0))}, do_compression=True)
    data = bytearray(path.read_bytes())
    data[place] ^= 0x55
    path.write_bytes(data)
    try:
        open_table(path)
    except Failure as failure:
        assert "log.mat" in str(failure)
