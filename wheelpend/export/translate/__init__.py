"""Kernels in another language: in goes the text of a generated module, out the same functions in C or JavaScript.

`program` what a translated function is made of · `specialise` a Python function for arguments of one kind: constants
folded, dead branches and empty arrays left out, every kind known · `expressions` of it · `c_code`, `javascript_code`
print it.
"""
