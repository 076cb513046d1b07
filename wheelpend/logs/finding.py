"""The record of a fault."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Finding(NamedTuple):
    """A fault of a log that should be cured before a model is fitted to it.

    ``kind`` is time_shift, flipped_sign, swapped_channels, wrong_unit, relative_encoder, absolute_encoder,
    relative_second_encoder, absolute_second_encoder, wrapped_angle, gap, stand_still, counts, duty, offset,
    dropped_rows, rounded_times, retimed_rows, stamp_jitter, sample_jitter, saturation, lying, joined, no_excitation,
    rectified, speed, friction_like_input, spikes, jump, copy or filtered. ``size`` is the time of a time_shift
    (positive for a late sensor and for an input that acts late), of the longest gap, of all stand_still and lying
    together and of a seam [s]; the factor of wrong_unit; the turn of wrapped_angle; the ceiling of saturation; the
    share of dropped rows; the step of rounded times and the jitter [s]; by how much the largest of spikes is off, or
    the sensor jumps [unit of the channel].
    """

    kind: str
    channel: str  # name of a column, or several joined with " and "
    sentence: str  # what was seen
    cure: str  # what to do
    size: float | None
    settings: Mapping[str, Any] = {}  # what `wheelpend set` takes to cure it, where the model file does
    effect: str = ""  # that the finding is of where it is physics: to be added then

    def to_json(self) -> dict[str, Any]:
        """The finding under the keys of JSON."""
        return {
            "kind": self.kind,
            "channel": self.channel,
            "sentence": self.sentence,
            "cure": self.cure,
            "size": self.size,
            "settings": self.settings,
            "effect": self.effect,
        }
