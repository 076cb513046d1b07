"""An export on an emulated Cortex-M4F: compiled with newlib, run by QEMU."""

import shutil
import subprocess
from pathlib import Path

import pytest

from wheelpend.export.c_target import c_files
from wheelpend.export.exported_model import exported_model

FIRMWARE_FOLDER = Path(__file__).parent / "firmware"
FIRMWARE = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
SINGLE = ("-O2", "-ffp-contract=off", "-fno-math-errno", "-std=c99", "-DWP_SINGLE")
needs_emulator = pytest.mark.skipif(
    not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")),
    reason="needs arm-none-eabi-gcc and qemu-system-arm",
)


def sources(folder, model, program):
    """Arguments of a compiler for an export and a program of this folder with it."""
    for name, text in c_files(exported_model(model)).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return [folder / "src/wheelpend_model.c", FIRMWARE_FOLDER / program, "-I", folder / "src"]


def firmware(folder, source, *options):
    """Path of the program for the emulated board."""
    arm = ["arm-none-eabi-gcc", *FIRMWARE, *options]

    def part(name):
        found = subprocess.run([*arm, f"-print-file-name={name}"], capture_output=True, text=True, check=True)
        return found.stdout.strip()

    start = [part(name) for name in ("crti.o", "crtn.o")]
    newlib = str(Path(part("libc.a")).parent / "rdimon-crt0.o")
    board = [FIRMWARE_FOLDER / "startup.c", "-T", FIRMWARE_FOLDER / "mps2.ld", "--specs=rdimon.specs", "-nostartfiles"]
    subprocess.run([*arm, *source, *board, newlib, *start, "-o", folder / "firmware.elf", "-lm"], check=True)
    return folder / "firmware.elf"


def emulated(program, *options):
    """What a program prints on the emulated board."""
    quiet = ["-nographic", "-monitor", "none", "-serial", "none", "-semihosting-config", "enable=on,target=native"]
    command = ["qemu-system-arm", "-machine", "mps2-an386", *quiet, *options, "-kernel", program]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
