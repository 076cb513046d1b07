"""The workbench in the browser: the way of working as a page, on this machine alone.

In: a workspace and logs. Out: a page, served to whoever has its address. Question: how is the work done by clicks?

It is a view. Whatever a click does is a command line, run as a process in the workspace: the workbench estimates
nothing and keeps nothing beside the workspace.

access     who may ask: the token of the address, the hosts and origins that are this machine's own
server     the address, the process that serves it, and its end by Ctrl-C
jobs       one command line as a process: its progress, its result, its end
bench      what all windows share: workspace, logs, jobs in turn and their latest results
workspace_watch    what shows that a workspace changed, by whichever command
hints      what to do next: the way of working, a click at a time
layout     the page: the steps of the work from top to bottom
status_line    what runs and how to end it, or what comes next
panel      a step of the work as a part of the page; text, tables, charts and buttons
open_panel, compare_panel, see_panel, learn_panel, add_panel, go_on_panel    the six steps
what_if_panel    sliders, between seeing and learning
asked      the words of a process that only the workbench starts
predictions    a process that predicts logs, for the chart of them
force_charts    the missing force over time, a state, a pair of them
time_chart    signals over time in panes that are zoomed together, reduced to the window
prediction_chart    measured and predicted of each channel, zoomed together
readings   a process that writes the signals of logs as they are read, and how the model file says to read them
readings_chart    those signals, zoomed together
reading_form    how each quantity and each sensor is read, to be corrected
corrections    what is wrong or chosen otherwise as settings of a command line
stretch_control    which stretch of a log is held out, by two sliders under its chart
residual_tests    what is left of each channel: white, or predicted by past inputs
design_form    limits of the next log as sliders, and the command that was designed
own_effect  an effect of one's own, checked while it is typed
reduction  many samples as what a window can show of them
words      results of commands as words and cells
uploads    logs that were dropped on the page
"""
