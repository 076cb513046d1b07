"""The model of a workspace: model.toml, effects.toml, generated code and history.

In: text of people. Out: `Model`, checked, and the fewest edits that change it. Question: what is assumed and known of
this machine?
"""
