"""Case studies on measured logs, each a page of docs with its figures.

In: logs of a machine axis (EMPS), a balancing robot, a free pendulum, a servo with a pendulum and an arm of two links,
which lie beside the project. Out: a page on each, with its figures. Question: what does the tool find on measured
machines, and does it agree with what is published or with a judge in which the estimator has no part?

emps, robot, pendulum, servo, arm    the machines, after the templates of the same names
rungs       the models of an error ladder with their values, and what every page says of a ladder
free_run    judge of the free pendulum: a run over the whole record
roll_out    judge of the servo: whole logs predicted from their first state
torque      judge of the arm: the torques that its equations need
pairs       what is found in every two of the servo's logs, which servo_logs lists
drawing, traces    figures
"""
