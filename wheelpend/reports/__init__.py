"""Results for people: terminal text, pictures and the HTML page.

In: results of every room above. Out: text and files. Question: how is it said?

numbers    numbers as text; nothing else in the reports rounds
names      names of states and signals with Greek letters and dots
characters that steer a terminal, shown as escapes
console    the terminal: results, tables, progress, failures
wrapping   text and tables folded to a width
inputs     measurement files that a command may read
outputs    files that a command may write, and those that it may not
ladder     the error ladder: rungs, lengths of bars, an SVG picture
drawing    pictures by matplotlib: one style, the colours that all share, grids of axes as PNG
plots      results as pictures for a notebook: `.plot()`
html       pages from a template and a style sheet
text/      results as sentences, lines and tables, a file per result
page/      the self-contained page: template, style sheet, figures, rows of tables
"""
