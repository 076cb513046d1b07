"""The command line: one function per command, thin.

In: arguments. Out: results as text or JSON, exit codes. Question: what did the user ask for?
"""
