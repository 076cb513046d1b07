"""The accepted model elsewhere: its equations in another language, and what becomes of its error there.

In: a model with its values, logs to replay. Out: files, with a ledger of what they carry. Question: how does another
language or simulator say what the model says?

export               targets and their files
exported_model       values, sizes and the kernels that are translated
translate/           a generated module's functions in C and JavaScript
compensation         which effects a command can take away, and by how much
ledger               what a target carries, and its error
replay               logs as they are to be run in a target, and the error there
running              programs of this machine that run an export
context              what they are given in every language
templates            of the files around translated functions, in c/, javascript/ and fmu/
c_target             a C library
c_channels           what is said there of each sensor and of the input
c_replay             the same, compiled and run
javascript_target    an ES module
javascript_replay    the same, run
fmu_target           FMUs of FMI 2.0 and 3.0
fmu_variables        what they declare, numbered
fmu_units            units as FMI has them
fmu_replay           the same, run by FMPy
mujoco_target        an MJCF
mujoco_replay        the same, run
json_target          numbers, units and equations
"""
