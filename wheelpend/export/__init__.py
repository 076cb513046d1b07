"""The accepted model elsewhere: in goes a model with its values, out come its equations in another language.

`export` targets and files · `exported_model` values, sizes and the kernels that are translated · `translate/` a
generated module's functions in C and JavaScript · `compensation` what a command can take away · `ledger` what a
target carries · `replay` a log run in the target, `running` with programs of this machine · per target `c_target`,
`c_replay`, `javascript_target`, `javascript_replay`, `json_target`, with templates in `c/` and `javascript/`.
"""
