"""Growth of time and memory with the log, the effects and the batch.

In: work of increasing size. Out: one ScalingPoint per size, their table and picture in docs/performance.md. Question:
with which power do time and memory grow? Run by ``python -m wheelpend.benchmarks.speed.growth``.

curve    a kind of work over its sizes, and the exponent of its growth
work     the work itself, made ready for a size
measure  one size in a process of its own
page     table and picture
"""
