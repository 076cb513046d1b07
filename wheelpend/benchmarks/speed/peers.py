"""Other packages at the same work: python peers.py NAME PROBLEM.npz, in an environment that has them.

Imports nothing of wheelpend. Works once and prints its result as JSON; then, for every line on standard input, works
once more and prints how much processor time that took [s]. What fails is printed as {"failure": "..."}.
"""

import json
import math
import sys
from time import process_time

import numpy as np

CART_POLE = """
<mujoco>
  <option timestep="0.001" integrator="RK4" gravity="0 0 -9.81"><flag contact="disable"/></option>
  <worldbody>
    <body>
      <joint type="slide" axis="1 0 0" damping="0.1"/>
      <geom type="sphere" size="0.1" mass="5"/>
      <body>
        <joint type="hinge" axis="0 1 0" damping="0.1"/>
        <geom type="sphere" size="0.1" mass="10" pos="0 0 -0.7"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def casadi(problem):
    """The closed loop by CasADi's virtual machine: one RK4 step as an SX function, mapped over all samples."""
    import casadi as ca

    z, given, X = ca.SX.sym("z", 5), ca.SX.sym("given", 4), problem["parameters"]
    reference, rate, before, h = ca.vertsplit(given)
    error = reference - z[1]
    integral = z[4] + error * before
    kp, ki, kd = problem["gains"]
    voltage = kp * error + ki * integral + kd * (rate - z[3])

    def slope(x):
        return ca.vertcat(x[2], x[3], *accelerations(X, voltage, x[2], x[3], ca.sin(x[1]), ca.cos(x[1])))

    step = ca.Function("step", [z, given], [ca.vertcat(runge_kutta(slope, z[:4], h), integral)])
    loop, start = step.mapaccum(len(problem["t"]) - 1), ca.DM(np.append(problem["state"], 0.0))
    inputs = ca.DM(samples(problem).T)
    return lambda: np.array(loop(start, inputs))[:4, -1]


def mujoco(problem):
    """Free motion of a cart-pole, as many states and steps, without Python between them."""
    import mujoco as mj

    model, steps = mj.MjModel.from_xml_string(CART_POLE), len(problem["t"]) - 1
    data = mj.MjData(model)

    def work():
        mj.mj_resetData(model, data)
        data.qpos[1] = 0.3
        mj.mj_step(model, data, steps)
        return data.qpos

    return work


def lambdify(problem):
    """The closed loop with the equations of motion solved by SymPy and lambdified, and Runge-Kutta steps in NumPy."""
    import sympy as sp

    voltage, angle, wheel, body = sp.symbols("voltage angle wheel body")
    X1, X2, X3, X4, X5, X6, X7 = symbols = sp.symbols("X1:8")
    drive, mixed = voltage - X6 * wheel + X7 * body, X3 * sp.cos(angle) - X2
    forces = sp.Matrix([drive + X3 * body**2 * sp.sin(angle), X5 * sp.sin(angle) - drive])
    solved = sp.Matrix([[X1 + X2, mixed], [mixed, X2 + X4]]).LUsolve(forces)
    acceleration, X = sp.lambdify((voltage, angle, wheel, body, symbols), solved, "numpy"), problem["parameters"]

    def slope(x, voltage):
        return np.append(x[2:], acceleration(voltage, *x[1:], X))

    gains, inputs = problem["gains"], samples(problem)

    def work():
        x, integral = problem["state"], 0.0
        for reference, rate, before, h in inputs:
            error = reference - x[1]
            integral += error * before
            voltage = gains @ (error, integral, rate - x[3])
            x = runge_kutta(lambda x, voltage=voltage: slope(x, voltage), x, h)
        return x

    return work


def accelerations(X, voltage, wheel, body, sine, cosine):
    """Of wheel and body (paper eqs. 19, 20), of numbers or symbols."""
    drive = voltage - X[5] * wheel + X[6] * body
    on_wheel, on_body = drive + X[2] * body**2 * sine, X[4] * sine - drive
    m11, m12, m22 = X[0] + X[1], X[2] * cosine - X[1], X[1] + X[3]
    scale = 1 / (m11 * m22 - m12**2)
    return (m22 * on_wheel - m12 * on_body) * scale, (m11 * on_body - m12 * on_wheel) * scale


def runge_kutta(slope, x, h):
    """One step of the classical method, of arrays or symbols."""
    k1 = slope(x)
    k2 = slope(x + h / 2 * k1)
    k3 = slope(x + h / 2 * k2)
    k4 = slope(x + h * k3)
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def samples(problem):
    """Per step (N - 1, 4): reference, its rate, time since the sample before and until the next."""
    h = np.diff(problem["t"])
    return np.column_stack([problem["reference"][:-1], problem["rate"][:-1], np.append(0.0, h[:-1]), h])


def scipy(problem):
    """The filtered regression with scipy.signal.lfilter on whole arrays, for a log that begins at rest."""
    from scipy.signal import lfilter

    states, voltage, h, (tau1, tau2) = problem["states"], problem["voltage"], float(problem["h"]), problem["tau"]
    e1, e2, coupling, old1, new1, old2, new2 = weights(h, tau1, tau2)

    def stages(old, new, start=0.0):
        """Both stages of 1/((tau1 s + 1)(tau2 s + 1)) after the first sample, from where both are at ``start``."""
        first = lfilter([1.0], [1.0, -e1], old1 * old + new1 * new, zi=[e1 * start])[0]
        before = np.append(start, first[:-1])
        return first, lfilter([1.0], [1.0, -e2], coupling * before + old2 * old + new2 * new, zi=[e2 * start])[0]

    def rate(first, second):
        return (first - second) / tau2

    def work():
        sine, cosine = np.sin(states[:, 1]), np.cos(states[:, 1])
        wheel, pitch_rate = np.diff(states[:, 0]) / h, states[:, 3]
        turned = stages(states[:-1, 0], states[1:, 0], states[0, 0])
        leant = stages(states[:-1, 1], states[1:, 1], states[0, 1])
        swing = cosine * pitch_rate
        spin = stages(-sine[:-1] * pitch_rate[:-1] * wheel, -sine[1:] * pitch_rate[1:] * wheel)[1]
        spin_rate = rate(*stages(-cosine[:-1] * wheel, -cosine[1:] * wheel))
        turned_rate, leant_rate = rate(*turned), rate(*leant)
        turned_twice = ((states[1:, 0] - turned[0]) / tau1 - turned_rate) / tau2
        leant_twice = ((states[1:, 1] - leant[0]) / tau1 - leant_rate) / tau2
        swing_rate, gravity = rate(*stages(swing[:-1], swing[1:])), stages(sine[:-1], sine[1:])[1]
        drive, nothing = stages(voltage[:-1], voltage[:-1])[1], np.zeros(len(wheel))
        first, last = turned_twice - leant_twice, (turned_rate, -leant_rate, drive)  # what both rows share
        wheel_row = (turned_twice, first, swing_rate, nothing, nothing, *last)
        body_row = (nothing, first, spin + spin_rate, -leant_twice, gravity, *last)
        matrix = np.concatenate([np.column_stack(row) for row in (wheel_row, body_row)])
        return matrix.T @ matrix

    return work


def weights(h, tau1, tau2):
    """Exact step of two first-order stages for an input linear between samples.

    Decay of the first and of the second, coupling of the first into the second, weights of the old and the new input in
    the first and in the second.
    """
    e1, e2 = math.exp(-h / tau1), math.exp(-h / tau2)
    coupling = tau1 / (tau1 - tau2) * (e1 - e2)
    ramp1, ramp2 = 1 - tau1 / h * (1 - e1), 1 - tau2 / h * (1 - e2)
    step2 = (tau1 * (1 - e1) - tau2 * (1 - e2)) / (tau1 - tau2)
    both = (tau1 * ramp1 - tau2 * ramp2) / (tau1 - tau2)
    return e1, e2, coupling, 1 - e1 - ramp1, ramp1, step2 - both, both


def padasip(problem):
    """Recursive least squares, row by row."""
    import padasip as pa

    phi, tau = problem["phi"], problem["tau"]

    def work():
        adaptive = pa.filters.FilterRLS(phi.shape[1], mu=1.0, eps=float(problem["eps"]), w="zeros")
        for row, side in zip(phi, tau, strict=True):
            adaptive.adapt(side, row)
        return adaptive.w

    return work


def pysindy(problem):
    """One sparse regression by stepwise removal of columns."""
    import pysindy as ps

    columns, sides = problem["columns"], problem["sides"]
    return lambda: ps.SSR(criteria="model_residual").fit(columns, sides).coef_


def main():
    """Work once, then once more for every line that comes."""
    name, file = sys.argv[1:]
    try:
        problem = dict(np.load(file))
        work = {w.__name__: w for w in (casadi, mujoco, lambdify, scipy, padasip, pysindy)}[name](problem)
        print(json.dumps({"result": np.asarray(work()).tolist()}), flush=True)
        for _ in sys.stdin:
            begin = process_time()
            work()
            print(json.dumps({"seconds": process_time() - begin}), flush=True)
    except Exception as error:  # whatever a package may raise is a reason why it is absent
        print(json.dumps({"failure": f"{type(error).__name__}: {error}"}), flush=True)


if __name__ == "__main__":
    main()
