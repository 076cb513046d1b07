"""Piecewise functions of the effects' laws, with derivatives that a kernel can evaluate.

SymPy's own Abs, sign and Max differentiate into Dirac deltas and Heaviside functions; at the corner itself these
return the value from one side, which is all that a simulation meets.
"""

from __future__ import annotations

import sympy as sp

TIME_SYMBOL = sp.Symbol("t", real=True)  # s from the log's first sample
INPUT_SYMBOL = sp.Symbol("input", real=True)  # the input that reaches the motor
LOAD_SYMBOL = sp.Symbol("load", real=True)  # the motor's load on a port, in volt-equivalents


class Step(sp.Function):
    """1 where the argument is positive, else 0."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Derivative away from the corner."""
        return sp.Integer(0)


class Sign(sp.Function):
    """−1, 0 or 1."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Derivative away from the corner."""
        return sp.Integer(0)


class Magnitude(sp.Function):
    """Absolute value."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Derivative away from the corner."""
        return Sign(self.args[0])


class Ramp(sp.Function):
    """The argument where it is positive, else 0."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Derivative away from the corner."""
        return Step(self.args[0])


class Least(sp.Function):
    """The smaller of two arguments; either may be infinite."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Derivative away from the corner."""
        one, other = self.args if argindex == 1 else reversed(self.args)
        return Step(other - one)


class Decay(sp.Function):
    """exp(−path/length); where the length is not positive 1 at path 0, else 0."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Derivative; zero where the length is not positive."""
        path, length = self.args
        return -Inverse(length) * self if argindex == 1 else path * Inverse(length) ** 2 * self


class Inverse(sp.Function):
    """1/x where x is positive, else 0."""

    is_real = True

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Derivative where x is positive."""
        return -(Inverse(self.args[0]) ** 2)


def symbol(name: str) -> sp.Symbol:
    """A plain real symbol; a parameter may carry a dot in its name."""
    return sp.Symbol(name, real=True)
