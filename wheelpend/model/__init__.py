"""The model of a workspace: model.toml, effects.toml, generated code and history.

In: text of people. Out: `Model`, checked, and the fewest edits that change it. Question: what is assumed and known of
this machine?

- record: the record `Model`, opened, parsed, changed and saved
- entries: the tables of a model.toml as records
- toml_file: text of a model.toml to those records
- toml_checks: checks of keys and values in any TOML file
- name_checks: names resolved against plant and library
- toml_edits: the fewest edits of a model.toml's text
- settings: KEY=VALUE checked and written into that text
- template: the first model.toml of a plant
- user_effects: effects.toml, read and added to
- user_plants: plants from a user's Python file
- units: units of a plant's quantities, and its force in physical ones
- equations: the derived equations as text, and what differs between two models
- model_kernels: kernels and generated files of a model
- precompile: all kernels compiled ahead of time
- transaction: files of a workspace changed together, by one process at a time
- workspace: a folder with model, generated code and history
"""
