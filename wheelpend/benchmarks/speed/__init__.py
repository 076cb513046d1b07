"""Speed beside peers: each piece of work that has to be fast, timed in turn with another way to do it.

In: the paper's robot and its logs. Out: a table of times, ratios and goals in docs/performance.md. Question: is the
tool as fast as it has to be beside C and other packages?

record         goal, row, result
rows           work, contender and goal of every row
setting        the paper's machine and what the rows share
timing         contenders in turn
reference      the same work by hand in C (reference.c)
peers          the same work with other packages, a script for their own environment
environment    starting that script
simulation     rows: closed loop, one trajectory and many
regression     rows: filtered regression, recursive least squares
filtering      rows: passes of the filter, the filter-error fit
fitting        rows: shooting fit, sensitivities, candidates, diagnosis
workbench      rows: the workbench in a browser
processes      rows: start of the command, derivation
page           the table, as text and in Markdown
growth         time and memory over the size of the work
"""
