"""A model as FMUs of FMI 2.0 and 3.0: model exchange and co-simulation, sources, and a binary for this machine."""

from __future__ import annotations

import hashlib
import io
import platform
import re
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import derive
from derive.effects import InputDelay, SensorDelay
from wheelpend.export.c_target import SOURCE_FILE, c_library
from wheelpend.export.exported_model import ExportedModel
from wheelpend.export.fmu_variables import fmu_variables
from wheelpend.export.ledger import Carried
from wheelpend.export.running import C_COMPILERS, COMPILER_FLAGS, found_program, run_program
from wheelpend.export.templates import file_template
from wheelpend.version import version

TEMPLATE_FOLDER = Path(__file__).with_name("fmu")
FMI_VERSIONS = (2, 3)
FMU_PARTS = ("machine", "modes")
DESCRIPTION_FILE, OWN_HEADER = "modelDescription.xml", "wheelpend_fmu.h"
ZIP_TIME = (1980, 1, 1, 0, 0, 0)  # of every file, so that the same export is the same file
LIBRARY_SUFFIXES = {"win32": ".dll", "darwin": ".dylib"}

IN_CO_SIMULATION = "exactly in co-simulation; in model exchange not: "
CARRIED_EXACTLY = Carried("exactly")
IN_FMU = (
    (InputDelay, Carried("approximately", f"{IN_CO_SIMULATION}delay the input where you connect it")),
    (SensorDelay, Carried("approximately", f"{IN_CO_SIMULATION}delay the outputs where you connect them")),
)


def fmu_name(exported: ExportedModel, fmi_version: int) -> str:
    """Name of the file."""
    return f"{_identifier(exported)}_fmi{fmi_version}.fmu"


def fmu_files(exported: ExportedModel) -> dict[str, bytes]:
    """Both FMUs by their names; without a binary where no compiler is installed or it does not compile them."""
    return {fmu_name(exported, v): _zipped(fmu_content(exported, v)) for v in FMI_VERSIONS}


def fmu_carried(exported: ExportedModel) -> Mapping[str, Carried]:
    """How each effect is carried."""
    rows = {n: derive.effects.find(n) for n in exported.model.effects}
    return {
        n: next((c for kind, c in IN_FMU if isinstance(row.enters, kind)), CARRIED_EXACTLY) for n, row in rows.items()
    }


def fmu_notes(files: Mapping[str, str | bytes]) -> list[str]:
    """What the files are not."""
    held = [zipfile.ZipFile(io.BytesIO(f)).namelist() for f in files.values() if isinstance(f, bytes)]
    binaries = sorted({n.split("/")[1] for names in held for n in names if n.startswith("binaries/")})
    if binaries:
        return [f"The binaries are for this machine ({', '.join(binaries)}); other ones are compiled from sources/."]
    why = "did not compile them" if found_program(C_COMPILERS, "CC") else "is installed here"
    return [f"There are sources and no binary, for {'a' if 'not' in why else 'no'} C compiler {why}."]


def fmu_content(exported: ExportedModel, fmi_version: int) -> dict[str, bytes]:
    """Files in an FMU by path."""
    plain = _plain_sources(exported, fmi_version)
    token = _token(exported, fmi_version, plain)
    sources = plain | {OWN_HEADER: _rendered(exported, f"{OWN_HEADER}.j2", fmi_version, token)}
    content = {f"sources/{name}": text.encode() for name, text in sources.items()}
    content[DESCRIPTION_FILE] = _rendered(exported, f"fmi{fmi_version}.xml.j2", fmi_version, token).encode()
    if fmi_version > 2:
        content["sources/buildDescription.xml"] = _rendered(exported, "build.xml.j2", fmi_version, token).encode()
    if binary := _compiled(exported, sources):
        content[_binary_path(exported, fmi_version)] = binary
    return content


def fmu_sources(exported: ExportedModel, fmi_version: int) -> dict[str, str]:
    """C sources and headers by name."""
    plain = _plain_sources(exported, fmi_version)
    token = _token(exported, fmi_version, plain)
    return plain | {OWN_HEADER: _rendered(exported, f"{OWN_HEADER}.j2", fmi_version, token)}


def _plain_sources(exported: ExportedModel, fmi_version: int) -> dict[str, str]:
    """Those without the token."""
    names = ("instance.h", "instance.c", f"fmi{fmi_version}.h", f"fmi{fmi_version}.c")
    own = {name: (TEMPLATE_FOLDER / name).read_text(encoding="utf-8") for name in names}
    return {**c_library(exported, FMU_PARTS), **own}


def _rendered(exported: ExportedModel, template: str, fmi_version: int, token: str) -> str:
    """A file of an FMU from its template."""
    variables = fmu_variables(exported)
    effects = ", ".join(exported.model.effects) or "none"
    return file_template(TEMPLATE_FOLDER, template).render(
        m=exported.module, token=token, identifier=_identifier(exported), version=version(),
        title=f"Model of {exported.model.plant}", description=f"identified by wheelpend; effects: {effects}",
        variables=variables.all(), outputs=variables.outputs, slopes=variables.slopes, reserves=variables.reserves,
        units=variables.units(), step=repr(exported.period), sources=(SOURCE_FILE, "instance.c", f"fmi{fmi_version}.c"),
        flags=" ".join(COMPILER_FLAGS), quoted=quoteattr,
    )  # fmt: skip


def _token(exported: ExportedModel, fmi_version: int, plain: Mapping[str, str]) -> str:
    """What tells these files from those of another model: a digest of all that is in them."""
    rendered = [_rendered(exported, n, fmi_version, "") for n in (f"{OWN_HEADER}.j2", f"fmi{fmi_version}.xml.j2")]
    digest = hashlib.sha256("\n".join([*plain.values(), *rendered]).encode()).hexdigest()
    return "{" + str(uuid.UUID(digest[:32])) + "}"


def _identifier(exported: ExportedModel) -> str:
    return "wheelpend_" + re.sub(r"\W", "_", exported.model.plant, flags=re.ASCII)


def _compiled(exported: ExportedModel, sources: Mapping[str, str]) -> bytes | None:
    """The shared library of an FMU; None where there is no compiler, or it does not compile them."""
    compiler = found_program(C_COMPILERS, "CC")
    if not compiler:
        return None
    with tempfile.TemporaryDirectory(prefix="wheelpend-export-") as name:
        folder, library = Path(name), f"{_identifier(exported)}{LIBRARY_SUFFIXES.get(sys.platform, '.so')}"
        for path, text in sources.items():
            (folder / path).write_text(text, encoding="utf-8")
        flags = (*COMPILER_FLAGS, "-shared", "-fPIC", "-fvisibility=hidden")
        units = [n for n in sources if n.endswith(".c")]
        wrong = run_program([compiler, *flags, *units, "-o", library, "-lm"], folder)[1]
        return None if wrong else (folder / library).read_bytes()


def _binary_path(exported: ExportedModel, fmi_version: int) -> str:
    """Where the binary of this machine belongs in an FMU."""
    system = {"win32": "windows", "darwin": "darwin"}.get(sys.platform, "linux")
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    short = {"windows": "win", "linux": "linux", "darwin": "darwin"}[system]
    place = f"{short}{64 if sys.maxsize > 2**32 else 32}" if fmi_version == 2 else f"{machine}-{system}"
    return f"binaries/{place}/{_identifier(exported)}{LIBRARY_SUFFIXES.get(sys.platform, '.so')}"


def _zipped(content: Mapping[str, bytes]) -> bytes:
    """Files as a ZIP archive, whose bytes follow from theirs."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as opened:
        for path in sorted(content):
            entry = zipfile.ZipInfo(path, ZIP_TIME)
            entry.external_attr, entry.compress_type = 0o644 << 16, zipfile.ZIP_DEFLATED
            opened.writestr(entry, content[path])
    return archive.getvalue()
