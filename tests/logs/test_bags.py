"""ROS 2 bags and MCAP files, written here and read back as logs."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support import simulated
from wheelpend import Failure, Model
from wheelpend.inspection.inspect import inspect_file
from wheelpend.logs.columns import ColumnMap
from wheelpend.logs.read import load_log

pytest.importorskip("mcap_ros2", reason="mcap-ros2-support is not installed: pip install '.[bags]'")


pytestmark = pytest.mark.extras

BEGIN = 1_700_000_000_000_000_000  # ns
COLUMNS = {
    "v_in": ColumnMap("motor/data"),
    "theta_w": ColumnMap("joint_states/position[wheel]"),
    "theta_p": ColumnMap("imu/orientation.x"),
    "dtheta_p": ColumnMap("imu/angular_velocity.y"),
}


def write_bag(path: Path, log, encoder_every: int = 1) -> None:
    """Commands, an IMU and joint states, each with stamps of its own; the encoder perhaps slower."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    nine = np.zeros(9)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        motor = writer.add_connection("/motor", "std_msgs/msg/Float64", typestore=store)
        imu = writer.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
        joints = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        for k, t in enumerate(log.t):
            stamp = BEGIN + round(t * 1e9)
            wheel, pitch, rate = log.measured[k]
            seconds = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
            header = types["std_msgs/msg/Header"](stamp=seconds, frame_id="")

            def write(connection, message, at=stamp):
                writer.write(connection, at, store.serialize_cdr(message, connection.msgtype))

            write(motor, types["std_msgs/msg/Float64"](data=float(log.voltage[k])))
            write(
                imu,
                types["sensor_msgs/msg/Imu"](
                    header=header,
                    orientation=quaternion(x=pitch, y=0.0, z=0.0, w=1.0),
                    orientation_covariance=nine,
                    angular_velocity=vector(x=0.0, y=rate, z=0.0),
                    angular_velocity_covariance=nine,
                    linear_acceleration=vector(x=0.0, y=0.0, z=9.8),
                    linear_acceleration_covariance=nine,
                ),
                stamp + 300_000,
            )  # logged later than it was measured
            if k % encoder_every == 0:
                write(
                    joints,
                    types["sensor_msgs/msg/JointState"](
                        header=header,
                        name=["caster", "wheel"],
                        position=np.array([0.0, wheel]),
                        velocity=np.array([]),
                        effort=np.array([]),
                    ),
                )


@pytest.mark.parametrize("single", [False, True])
def test_a_bag_is_a_log_like_any_other(tmp_path, single):
    log = simulated(duration=1.0)
    write_bag(tmp_path / "run", log)
    path = next((tmp_path / "run").glob("*.mcap")) if single else tmp_path / "run"
    read = load_log(path, COLUMNS)
    np.testing.assert_allclose(read.t, log.t, atol=1e-6)
    np.testing.assert_allclose(read.measured, log.measured, atol=1e-9)
    np.testing.assert_allclose(read.voltage, log.voltage)


def test_a_slower_topic_has_values_where_it_was_measured_and_none_between(tmp_path):
    log = simulated(duration=1.0)
    write_bag(tmp_path / "run", log, encoder_every=10)
    read = load_log(tmp_path / "run", COLUMNS)
    there = np.isfinite(read.measured[:, 0])
    assert np.flatnonzero(there).tolist() == list(range(0, len(log), 10))
    np.testing.assert_allclose(read.measured[there, 0], log.measured[::10, 0])
    assert np.isfinite(read.measured[:, 1:]).all() and np.isfinite(read.voltage).all()


def test_the_columns_of_a_bag_are_listed_and_guessed(tmp_path):
    write_bag(tmp_path / "run", simulated(duration=1.0))
    with pytest.raises(Failure, match=r"joint_states/position\[wheel\]"):
        load_log(tmp_path / "run")
    _, found = inspect_file(Model.default(), tmp_path / "run")
    assert 'theta_w = { column = "joint_states/position[wheel]" }' in found.proposal


def test_json_messages_in_an_mcap_file_are_read(tmp_path):
    from mcap.writer import Writer

    log = simulated(duration=1.0)
    with (tmp_path / "log.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(name="state", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(topic="state", message_encoding="json", schema_id=schema)
        for k, t in enumerate(log.t):
            wheel, pitch, rate = map(float, log.measured[k])
            data = {"u": float(log.voltage[k]), "robot": {"wheel": wheel, "pitch": pitch, "gyro": rate}, "note": "x"}
            at = BEGIN + round(t * 1e9)
            writer.add_message(channel, log_time=at, publish_time=at, data=json.dumps(data).encode())
        writer.finish()
    names = {"v_in": "u", "theta_w": "robot.wheel", "theta_p": "robot.pitch", "dtheta_p": "robot.gyro"}
    read = load_log(tmp_path / "log.mcap", {n: ColumnMap(f"state/{c}") for n, c in names.items()})
    np.testing.assert_allclose(read.measured, log.measured)


def test_a_damaged_bag_is_refused(tmp_path):
    (tmp_path / "log.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(range(200)))
    with pytest.raises(Failure, match="damaged"):
        load_log(tmp_path / "log.mcap")
