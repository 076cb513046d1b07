"""ROS 2 bags and MCAP files as tables: one column per number that a topic carries, brought onto one clock.

Columns are called topic/field, without the first slash: imu/angular_velocity.y, joint_states/position[left_wheel]. The
readers, rosbags for bags and mcap for single MCAP files, are pure Python and come with ``pip install wheelpend[bags]``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from wheelpend.errors import Failure
from wheelpend.files import refuse_special_file
from wheelpend.logs.tables import Table

MCAP_MAGIC = b"\x89MCAP0\r\n"
TIME_COLUMN = "t"
MAX_ARRAY_ENTRIES = 64  # entries of an array that become columns
MAX_INTERPOLATED_INTERVAL_RATIO = 1.5  # times the fastest topic's interval, up to which a topic is interpolated
SECONDS_PER_NANOSECOND = 1e-9  # s

Series = dict[str, tuple[np.ndarray, np.ndarray]]  # times [s] and values by column


def is_bag(path: Path) -> bool:
    """True of a ROS 2 bag's folder and of an MCAP file."""
    if path.is_dir():
        return (path / "metadata.yaml").exists()
    refuse_special_file(path)
    try:
        with path.open("rb") as file:
            return file.read(len(MCAP_MAGIC)) == MCAP_MAGIC
    except OSError:
        return False


def bag_table(path: Path) -> Table:
    """The columns of a bag; raises Failure where its reader is not installed, or it cannot be read."""
    try:
        series = collect_series(messages_in_bag(path) if path.is_dir() else messages_in_mcap(path))
    except ImportError as error:
        raise Failure(f"{path.name} needs the reader {error.name}, which is not installed. "
                      "Install it with: pip install 'wheelpend[bags]'") from None  # fmt: skip
    except Failure:
        raise
    except Exception as error:  # the readers raise a dozen kinds
        raise Failure(f"{path.name} is damaged and cannot be read as a bag: {error}.") from error
    if not series:
        raise Failure(f"{path.name} must hold messages with numbers, but it has none.")
    return Table([TIME_COLUMN, *series], lambda wanted: resample_to_fastest(series, wanted, []),
                 lambda wanted, zero_order_hold: resample_to_fastest(series, wanted, zero_order_hold))  # fmt: skip


def messages_in_bag(path: Path) -> Iterator[tuple[str, int, Any]]:
    """Topic, time [ns] and message of everything in a bag's folder, by their types where those are known."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
        for connection, stamp, raw in reader.messages():
            try:
                message = reader.deserialize(raw, connection.msgtype)
            except KeyError:
                continue  # a type that nobody described: where its numbers are is unknown
            yield connection.topic, stamp, message


def messages_in_mcap(path: Path) -> Iterator[tuple[str, int, Any]]:
    """Topic, time [ns] and message of everything in an MCAP file, ROS 2 or JSON."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as file:
        factory = DecoderFactory()
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.message_encoding == "json":
                yield channel.topic, message.log_time, json.loads(message.data)
            elif decode := factory.decoder_for(channel.message_encoding, schema):
                yield channel.topic, message.log_time, decode(message.data)


def collect_series(messages: Iterator[tuple[str, int, Any]]) -> Series:
    """Times and values of every number in messages; a message's own stamp counts where it has one."""
    times: dict[str, list[int]] = {}
    values: dict[str, list[float]] = {}
    for topic, logged, message in messages:
        stamp = header_time_ns(message) or logged
        for field, value in numbers_in(message):
            name = f"{topic.strip('/')}/{field}" if field else topic.strip("/")
            times.setdefault(name, []).append(stamp)
            values.setdefault(name, []).append(value)
    first = min((min(t) for t in times.values()), default=0)  # a clock's large offset would cost digits
    return {
        n: _sorted_by_time(SECONDS_PER_NANOSECOND * (np.array(times[n]) - first), np.array(v, dtype=float))
        for n, v in values.items()
    }


def _sorted_by_time(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples (M,) in the order of their times, only the last of those that share one."""
    order = np.argsort(t, kind="stable")
    t, values = t[order], values[order]
    last = np.append(np.diff(t) > 0, True)
    return t[last], values[last]


def fields_of(message: Any) -> list[tuple[str, Any]]:
    """Names and values of a message's fields."""
    if isinstance(message, dict):
        return list(message.items())
    names: Any = getattr(message, "__dataclass_fields__", None) or getattr(message, "__slots__", ())
    return [(n.lstrip("_"), getattr(message, n)) for n in names if not n.startswith("__")]


def header_time_ns(message: Any) -> int:
    """Time of a message's header [ns], 0 where it has none."""
    header = dict(fields_of(message)).get("header")
    stamp = dict(fields_of(header)).get("stamp") if header is not None else None
    parts: dict[str, Any] = dict(fields_of(stamp)) if stamp is not None else {}
    return 10**9 * int(parts.get("sec", 0)) + int(parts.get("nanosec", parts.get("nsec", 0)))


def numbers_in(message: Any, prefix: str = "", labels: list[str] | None = None) -> Iterator[tuple[str, float]]:
    """Names and values of the numbers in a message; entries of arrays go by the names that come with them."""
    fields = fields_of(message)
    names = [v for n, v in fields if n == "name" and isinstance(v, list | tuple)]
    labels = list(map(str, names[0])) if names else labels
    for name, value in fields:
        place = f"{prefix}.{name}" if prefix else name
        if name == "header":
            continue
        if isinstance(value, bool | int | float | np.integer | np.floating):
            yield place, float(value)
        elif isinstance(value, list | tuple | np.ndarray):
            yield from _array_entries(place, value, labels)
        elif not isinstance(value, str | bytes) and value is not None:
            yield from numbers_in(value, place, labels)


def _array_entries(place: str, values: Any, labels: list[str] | None) -> Iterator[tuple[str, float]]:
    """Names and values of an array's numbers, by label or else counted from 1; none of an array that is too long."""
    if not 0 < len(values) <= MAX_ARRAY_ENTRIES:
        return
    known = labels if labels and len(labels) == len(values) else [str(k) for k in range(1, len(values) + 1)]
    for label, value in zip(known, values, strict=True):
        if isinstance(value, bool | int | float | np.integer | np.floating):
            yield f"{place}[{label}]", float(value)


def resample_to_fastest(series: Series, wanted: list[str], zero_order_hold: list[str]) -> dict[str, np.ndarray]:
    """Columns at the times of the fastest of them, (N,) each; NaN where one has no value then.

    Columns under ``zero_order_hold``, inputs and commands, keep their last value. One that is nearly as fast as the
    fastest is interpolated linearly; of a slower one each value stands at the sample nearest to its time.
    """
    columns = [n for n in wanted if n != TIME_COLUMN]
    clock = max((series[n][0] for n in columns), key=lambda t: (len(t), -t[0]))
    found = {TIME_COLUMN: clock} if TIME_COLUMN in wanted else {}
    clock_interval = float(np.median(np.diff(clock))) if len(clock) > 1 else 1.0
    for name in columns:
        t, values = series[name]
        interval = float(np.median(np.diff(t))) if len(t) > 1 else np.inf
        if name in zero_order_hold:
            before = np.searchsorted(t, clock, side="right") - 1
            found[name] = np.where(before >= 0, values[np.maximum(before, 0)], np.nan)
        elif interval <= MAX_INTERPOLATED_INTERVAL_RATIO * clock_interval:
            near = np.abs(t[_nearest_indices(t, clock)] - clock) <= MAX_INTERPOLATED_INTERVAL_RATIO * clock_interval
            found[name] = np.where(near, np.interp(clock, t, values), np.nan)
        else:
            found[name] = np.full(len(clock), np.nan)
            found[name][_nearest_indices(clock, t)] = values
    return found


def _nearest_indices(t: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Index of the time nearest to each wanted one."""
    after = np.clip(np.searchsorted(t, wanted), 1, max(len(t) - 1, 1))
    after = np.minimum(after, len(t) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(wanted - t[before] < t[after] - wanted, before, after)
