"""Texts without what differs from run to run: paths, times, progress, versions, the library inside a page."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

ONCE = "once per machine"  # in every sentence about what is derived and compiled on first use
PROGRESS = re.compile(r"[a-z0-9 ]")  # how a line of progress begins; warnings and failures begin with a capital
COMPILED = re.compile(r"(Compiled the kernels of .* in|Every kernel of .* took) \d+ s\.")
VERSIONS = re.compile(r"wheelpend \S+, Python [\w.]+(, \w+ [\w.+]+)+")
LIBRARY = re.compile(r"<script[^>]*>\s*/\*\*\s*\* plotly\.js.*?</script>", re.DOTALL)
ARRAY = re.compile(r'\{"dtype":"(\w+)","bdata":"([^"]*)"(?:,"shape":"[^"]*")?\}')
PACKED = re.compile(r'\{"packed":"([^"]*)","middle":([^,]*),"step":([^}]*)\}')
DATE = re.compile(r'("date": ?)"[\d-]{10}"')
PICTURE = re.compile(r"data:image/png;base64,([A-Za-z0-9+/=]+)")


def without_paths(text: str, folders: Mapping[Path, str]) -> str:
    """Folders that differ from run to run by their names; the innermost first."""
    for folder in sorted(folders, key=lambda path: -len(str(path))):
        for spelled in (str(folder), str(folder.resolve())):
            text = text.replace(spelled, folders[folder])
    return text


def without_progress(text: str) -> str:
    """Standard error without lines of progress, which come every ten seconds."""
    kept = [line for line in text.splitlines() if not PROGRESS.match(line) and ONCE not in line]
    return "".join(f"{line}\n" for line in kept)


def without_times(text: str) -> str:
    """Standard output without what was compiled and how long it took."""
    return COMPILED.sub("<compiled>.", text)


def without_dates(text: str) -> str:
    """A history without the days of its changes."""
    return DATE.sub(r'\1"<date>"', text)


def page_text(page: str) -> str:
    """A page without plotly's code and without versions; figures have their numbers in plain text."""
    page = VERSIONS.sub("<versions>", LIBRARY.sub("<plotly.js>", page))
    page = ARRAY.sub(lambda found: _numbers(found[1], found[2]), page)
    page = PACKED.sub(lambda found: _packed_numbers(found[1], float(found[2]), float(found[3])), page)
    return PICTURE.sub(lambda found: fingerprint(base64.b64decode(found[1])), page)


def fingerprint(content: bytes) -> str:
    """What stands for a picture."""
    return f"sha256:{hashlib.sha256(content).hexdigest()}"


def _numbers(kind: str, encoded: str) -> str:
    values = np.frombuffer(base64.b64decode(json.loads(f'"{encoded}"')), dtype=np.dtype(kind))
    return f"[{', '.join(str(v) for v in values.tolist())}]"


def _packed_numbers(encoded: str, middle: float, step: float) -> str:
    values = middle + step * np.frombuffer(base64.b64decode(json.loads(f'"{encoded}"')), dtype="<i2")
    return f"[{', '.join(f'{v:.6g}' for v in values.tolist())}]"
