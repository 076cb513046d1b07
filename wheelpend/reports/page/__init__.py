"""The self-contained HTML page of an explanation.

In: a Ladder. Out: one file that needs no network. Question: what was missing, and how is it known?

page               the page from its template (page.html.j2, sections/) and style sheet (style.css)
story              what the workspace's history tells of earlier changes
rows               rows of its tables
equations          equations of motion before and after
innovations        tests of the final model's residuals
correlations       how parameters depend on each other
charts             its charts as markup
sliders            parameters that a reader moves, and the model that the page then simulates (sliders.js)
sliders_page       the sliders of a model as it stands, as a page of their own
carried_log        the log with which it does so
whole_numbers      series as text, as exact as a simulation needs them
packing            figures as text, and the script that reads it
thinning           samples that a chart draws
figures            ladder, predictions, parameters
force_figures      the missing force over time and states
binning            means over ranges of a state
effect_figures     every effect drawn with its band
effect_laws        axes and lines of an effect's drawing
digests            files that the logs were read from
law_expressions    laws as expressions and as functions of arrays
style              colours and frames
"""
