"""Compiled kernels of a model.

In: plant, assumptions and effects. Out: a generated module, derived and compiled once per machine and kept.
Question: where is the machine code that simulates and linearises this model?

- kernel_module: what a generated module offers, typed
- plant_signature: names, units and numbers of a plant, from the cache
- load: modules of a model, of the whole library, and with free forces
- cache: derived texts in files, by a hash of what decides them
- cache_folder: where they are, a folder that nobody else can write or exchange
- sealed_files: files that carry a hash of their content, and do not count where it is another
- kept_records: results that a later process takes up, in sealed files
- generated_text: text and bytecode of a generated module
- kernel_files: machine code in sealed files, in place of numba's cache
- machine_code: numba's cached machine code, loaded fast, and compiled elsewhere
- compilers: processes that compile, asked by this one
- compile_worker: what such a process does
- every_kernel: a call of every kernel, which compiles it
- first_use: notices of what is derived or compiled
"""
