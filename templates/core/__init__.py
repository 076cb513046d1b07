"""Functions of fixed text in every generated module.

``derive.emit.core`` copies them, from the decorator to the last line, to where a template names them. Their imports are
for linter, type checker and tests; a generated module has everything in its own file.
"""
