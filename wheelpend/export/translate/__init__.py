"""Kernels in another language.

In: the text of a generated module. Out: the same functions as text in C or JavaScript. Question: what does a kernel do,
once everything that is known beforehand is folded in?

program            what a translated function is made of
known              values that are known before it runs
specialise         a Python function for arguments of one kind
body, values       its statements and its expressions
idle               what it needs not do
printer            what languages agree on
c_code             C99
javascript_code    an ES module
"""
