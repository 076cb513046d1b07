"""The self-contained HTML page of an explanation.

In: a Ladder. Out: one file that needs no network. Question: what was missing, and how is it known?

page               the page from its template (page.html.j2, sections/) and style sheet (style.css)
story              what the workspace's history tells of earlier changes
rows               rows of its tables
equations          equations of motion before and after
charts             its charts as markup
packing            figures as text, and the script that reads it
thinning           samples that a chart draws
figures            ladder, predictions, parameters
force_figures      the missing force over time and states
effect_figures     every effect drawn with its band
effect_laws        axes and lines of an effect's drawing
law_expressions    laws as expressions and as functions of arrays
style              colours and frames
"""
