"""FMUs of models for tests, and instances of them under FMPy."""

import atexit
import shutil
import subprocess
from functools import lru_cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from tests.export.exporting import STRICT, interpreted, model_with
from tests.plants.machines import MACHINES, model_of
from wheelpend.export.exported_model import exported_model
from wheelpend.export.fmu_target import FMI_VERSIONS, fmu_files, fmu_sources
from wheelpend.export.fmu_variables import fmu_variables

OTHER_MACHINES = tuple(n for n, machine in MACHINES.items() if n != machine.plant or n == "lever")
FOLDER = Path(mkdtemp(prefix="wheelpend-fmu-"))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)


@lru_cache(maxsize=16)
def exported_with(plant, effects):
    """A plant with effects of their typical sizes, or a machine of tests/plants."""
    return exported_model(model_of(plant) if plant in OTHER_MACHINES else model_with(*effects, plant=plant))


@lru_cache(maxsize=16)
def fmu_paths(plant, effects):
    """Files of a model by FMI version, until the tests end."""
    folder = Path(mkdtemp(dir=FOLDER))
    made = fmu_files(exported_with(plant, effects))
    for name, content in made.items():
        (folder / name).write_bytes(content)
    return {version: str(folder / name) for version, name in zip(FMI_VERSIONS, made, strict=True)}


def compiled_strictly(exported, folder, compiler):
    """Compile the sources of both versions so that no warning passes."""
    for version in FMI_VERSIONS:
        for name, text in fmu_sources(exported, version).items():
            (folder / name).write_text(text)
        units = ["wheelpend_model.c", "instance.c", f"fmi{version}.c"]
        subprocess.run([compiler, *STRICT, "-fPIC", "-c", *units], cwd=folder, check=True)


class Instance:
    """An instance of an FMU of either version, its variables by name."""

    def __init__(self, plant, effects, version, kind="CoSimulation", logged=None):
        from fmpy import extract, read_model_description
        from fmpy.simulation import instantiate_fmu

        self.version = version
        path = fmu_paths(plant, effects)[version]
        self.description = read_model_description(path)
        self.place = {v.name: v.valueReference for v in self.description.modelVariables}
        self.fmu = instantiate_fmu(extract(path, mkdtemp(dir=FOLDER)), self.description, kind, logger=logged)

    def get(self, *names):
        read = self.fmu.getReal if self.version == 2 else self.fmu.getFloat64
        return np.array(read([self.place[n] for n in names]))

    def set(self, values):
        write = self.fmu.setReal if self.version == 2 else self.fmu.setFloat64
        write([self.place[n] for n in values], list(values.values()))

    def begin(self, values, start=0.0):
        """Initialise with these start values."""
        if self.version == 2:
            self.fmu.setupExperiment(startTime=start)
        self.set(values)
        if self.version == 2:
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start)
        self.fmu.exitInitializationMode()
        return self

    def settled(self):
        """What an event in model exchange says."""
        new = self.fmu.newDiscreteStates if self.version == 2 else self.fmu.updateDiscreteStates
        return new()

    def close(self):
        self.fmu.freeInstance()


def kernels_start(exported, state, given=lambda u: u):
    """The interpreted kernels of a machine in a state, and its arrays, every command until now having been zero."""
    e, kernels = exported, interpreted(exported.text)
    ring = (e.commands,) if e.inputs <= 1 else (e.commands, e.inputs)
    arrays = [e.parameters.copy(), np.zeros(e.size), np.zeros(ring), np.zeros((e.late_readings, e.module.NY))]
    kernels.start_machine(state, given(0.0), *arrays)
    return kernels, arrays


def start_values(exported, parameters, now):
    """The same start as start values of an FMU."""
    variables, module = fmu_variables(exported), exported.module
    values = dict(zip((v.name for v in variables.states), map(float, now), strict=True))
    if module.ORIGIN >= 0:
        values[module.PARAMETERS[module.ORIGIN]] = float(parameters[module.ORIGIN])
    return values


def stepped(times, commands, name="v_in"):
    """An input that is held from each time to the next, as FMPy reads it."""
    rows = [(times[0], commands[0])]
    for k in range(1, len(times)):
        rows += [(times[k], commands[k - 1]), (times[k], commands[k])]
    return np.array(rows, dtype=[("time", float), (name, float)])
