"""Whether a campaign finds the units of a fleet that aged, by what, and accuses no other.

In: simulated fleets whose units scatter, a few of them aged in one parameter. Out: an estimate per unit, a table of
recall, false accusations and intervals, docs/fleets.md. Question: of a hundred robots, does it find the worn ones?

cases     which unit of which fleet is how
trial     one unit: simulated, identified, and diagnosed where it stands out
summary   what stands out in each fleet, beside what aged
made_up   fleets of numbers alone
scaling   what a campaign costs over workers and logs; one_campaign one of them in a process
page      docs/fleets.md between its marks
"""
