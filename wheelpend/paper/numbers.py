"""Every number that the paper prints and this project compares with, typed as printed: errors in %, times in s."""

from __future__ import annotations

from typing import NamedTuple


class Column(NamedTuple):
    """One column of estimates in a table: X1...X7 in order, and the errors printed beside them [%]."""

    estimates: tuple[float, ...]
    errors: tuple[float, ...]


REFERENCE_PARAMETERS = {
    "X1": 0.0436,
    "X2": 0.0178,
    "X3": 0.1149,
    "X4": 0.8719,
    "X5": 4.6701,
    "X6": 0.7268,
    "X7": 0.7256,
}

PHYSICAL_CONSTANTS = {  # section 4; J_m and f_w are not given
    "m": 4.6,  # kg
    "L": 1.8,  # m
    "M": 110.0,  # kg
    "R": 0.2413,  # m
    "epsilon": 14.0,
    "f_m": 0.3,  # N m s/rad
    "K_b": 0.722,  # V s/rad
    "K_t": 0.833,  # N m/A
    "R_m": 0.141,  # ohm
    "J_w": 0.1339,  # kg m²
    "J_b": 87.89,  # kg m²
}

SIMULATION_SETTINGS: dict[str, str] = {  # section 4; what a simulation needs and the paper states
    "integration step": "0.001 s",
    "proportional gain": "-168",
    "integral gain": "-800",
    "derivative gain": "-8.8",
    "commands": "R_simple(t), R_aggressive(t), in degrees",
    "initial state": "0, 0, 0, 0",
    "encoder counts": "60000 per revolution",
    "noise of the pitch": "0.5 degrees",
    "noise of the pitch rate": "0.5 degrees/s",
}

SIMPLE_DIFFERENTIATION = Column(
    (0.004628, -0.006094, -0.003984, 0.008320, 3.43352, 0.75595, -2.12978),
    (89.38, 134.24, 103.47, 99.05, 26.48, 4.012, 393.52),
)
SIMPLE_FILTERED = Column(
    (0.02921, 0.03071, 0.06709, 0.51477, 2.85297, 0.72685, 0.72526),
    (33.04, 72.52, 41.60, 40.96, 38.91, 0.0073, 0.0474),
)
AGGRESSIVE_FILTERED = Column(
    (0.04991, 0.01276, 0.10695, 0.83680, 4.67882, 0.72695, 0.70581),
    (14.46, 28.26, 6.914, 4.027, 0.1025, 0.0212, 2.7282),
)
TABLE_1_TAU = (2.25, 6.5)  # s, of Tables 1 and 2

TABLE_3 = {  # case: time constant tau1 = tau2 [s], whether the initial pitch is 0.5 degrees off, column
    "A": (0.014, False, Column(
        (0.04355, 0.01781, 0.11475, 0.87128, 4.66554, 0.72684, 0.72516),
        (0.1074, 0.0764, 0.1239, 0.0707, 0.0974, 0.0061, 0.0600))),
    "B": (0.014, True, Column(
        (0.00590, 0.03485, -0.00727, -0.01024, 0.65966, 0.72719, 0.72203),
        (86.458, 95.787, 1.0633, 1.0117, 85.874, 0.0546, 0.4914))),
    "C": (0.14, True, Column(
        (0.04033, 0.01959, 0.10586, 0.80374, 4.34846, 0.72684, 0.72592),
        (7.4825, 10.059, 7.8629, 7.8169, 6.8870, 0.0064, 0.0442))),
    "D": (4.2, True, Column(
        (0.05016, 0.01248, 0.12766, 0.97554, 5.24997, 0.72686, 0.71614),
        (15.053, 29.844, 11.106, 11.886, 12.416, 0.0084, 1.3031))),
}  # fmt: skip

PREDICTION_RMSE = {  # Figure 5, of the closed-loop predictions: (simple command, aggressive command)
    "theta_w": (0.2423, 0.3260),  # rad
    "theta_p": (0.0016, 6.8181e-04),  # rad
    "dtheta_w": (0.1267, 0.1585),  # rad/s
    "dtheta_p": (0.0201, 0.0064),  # rad/s
}
