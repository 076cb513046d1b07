"""What an exported compensator and identifier do in a loop: friction taken away in MuJoCo, parameters learnt.

In: the paper's robot in MuJoCo or in this project's simulator. Out: answers of single runs, a section and a picture of
docs/export_c.md. Questions: how much of what friction does to the pitch is left, does compensation start a limit cycle,
and how near is what the identifier learns to the Cramér-Rao bound of the record?

observed    observer, compensator and identifier of an export, by their kernels
compensate  one draw from what an identification left open, over sizes of friction
learn       one record, on which the identifier begins a fifth off
runner      all draws and records, on all cores, resumed after an interruption
page        the section of docs/export_c.md and its picture
"""
