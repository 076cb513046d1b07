"""The command line: one function per command, thin.

In: arguments. Out: results as text or JSON, exit codes. Question: what did the user ask for?

main         entry point
commands     the application with every command
app          the Typer application
next_step    what to do after a command
options      arguments and options that several commands share, or that make one long
loop         identify, compare, diagnose, add, remove, explain, report, demo
logs         simulate, inspect, design, campaign
workspace    new, set, equations, generate, history, effects, warm
export       export
view         view
view_figures    a process that draws what a diagnosis found, for the workbench
view_sliders    a process that writes sliders for the model as it stands, for the workbench
paper        verify, reproduce
kept_searches    what was searched for before is not searched for again
change, design, campaign, demo    what these commands do around a result: files, history, interruptions
"""
