"""Speed beside peers: each piece of work that has to be fast, timed in turn with what else would do it.

record         goal, row, result
rows           which work, against whom, how fast it has to be
setting        the paper's machine and what the rows share
timing         contenders in turn
reference      the same work by hand in C (reference.c)
peers          the same work with other packages, a script for their own environment
environment    starting that script
simulation     rows: closed loop, one trajectory and many
regression     rows: filtered regression, recursive least squares
fitting        rows: shooting fit, sensitivities, candidates, diagnosis
processes      rows: start of the command, derivation
page           the table, as text and in Markdown
"""
