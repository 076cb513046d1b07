"""Case studies on measured logs, written to docs/emps.md and docs/robot.md.

In: the logs of a machine axis (EMPS) and of a balancing robot, which lie beside the project. Out: two pages with their
figures. Question: what does the tool find on measured machines, and does it agree with what is published?

emps     the machine axis, after emps.md
robot    the balancing robot, after robot.md
drawing  their figures
"""
