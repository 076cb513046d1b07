"""Characters of names that are not ours, shown so that none of them steers a terminal or turns a text around."""

from __future__ import annotations

import unicodedata

STEERING_CATEGORIES = {"Cc", "Cf", "Cs"}  # control, format (direction overrides among them), halves of characters
KEPT_CHARACTERS = "\n\t\u00ad\u200c\u200d"  # of these: line ends, tabulators, soft hyphens, joiners


def visible(text: str) -> str:
    """A text in which characters that steer are written as escapes."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_escaped(c) if _steers(c) else c for c in text)


def _steers(character: str) -> bool:
    return unicodedata.category(character) in STEERING_CATEGORIES and character not in KEPT_CHARACTERS


def _escaped(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
