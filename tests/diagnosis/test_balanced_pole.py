"""Dry friction under a balanced pole on a cart, played by a program of its own, is named beside a random force."""

from functools import lru_cache

import numpy as np
import pytest

from wheelpend import Log, Model, diagnose

GAIN, CART, POLE, REACH, GRAVITY = 1.72, 0.94, 0.23, 0.33, 9.81  # N/V, kg, kg, m, m/s²
INERTIA, VISCOUS, DRY = POLE * 0.64**2 / 12.0, 9.74, 1.5  # kg m², N s/m, N
RANDOM_RMS, RANDOM_TIME_S = 0.15, 0.1  # N, s
STEP_S, EVERY, SAMPLES = 2e-4, 10, 8000  # 500 Hz, 16 s
CART_STEP_M, POLE_STEP_RAD = 2.27e-5, 1.5e-3  # of the encoders
GAINS = np.array([-31.6, -96.9, -31.4, -20.2])  # V/m, V/rad, V s/m, V s/rad: LQR
MODEL = 'plant = "cart_pole"\neffects = []\n'


@lru_cache
def balanced_log() -> Log:
    """Cart and pole as the encoders see them, the cart following a square wave and a sine; by semi-implicit steps."""
    random = np.random.default_rng(1)
    decay, force, volts = np.exp(-STEP_S / RANDOM_TIME_S), 0.0, 0.0
    place, speed = np.array([0.0, 0.03]), np.zeros(2)
    read, rates, rows = place.copy(), np.zeros(2), []
    for step in range(SAMPLES * EVERY):
        if step % EVERY == 0:
            t, before = step * STEP_S, read
            read = np.round(place / (CART_STEP_M, POLE_STEP_RAD)) * (CART_STEP_M, POLE_STEP_RAD)
            rates = 0.887 * rates + 0.113 * (read - before) / (EVERY * STEP_S)
            wanted = 0.15 * np.sin(2.0 * np.pi * 0.25 * t) + 0.08 * np.sign(np.sin(2.0 * np.pi * 0.11 * t))
            volts = float(np.clip(-GAINS @ [read[0] - wanted, read[1], *rates], -10.0, 10.0))
            rows.append((t, volts, *read))
        force = decay * force + RANDOM_RMS * np.sqrt(1.0 - decay**2) * random.standard_normal()
        total, coupling, swing = CART + POLE, POLE * REACH * np.cos(place[1]), INERTIA + POLE * REACH**2
        along = np.array([[swing, -coupling], [-coupling, total]]) / (total * swing - coupling**2)
        push = GAIN * volts - VISCOUS * speed[0] + force + POLE * REACH * speed[1] ** 2 * np.sin(place[1])
        free = speed + STEP_S * along @ [push, POLE * GRAVITY * REACH * np.sin(place[1])]
        rubs = float(np.clip(-free[0] / (STEP_S * along[0, 0]), -DRY, DRY))
        speed = free + STEP_S * along @ [rubs, 0.0]
        place = place + STEP_S * speed
    t, volts, *read = np.array(rows).T
    return Log("balanced pole", t, volts, np.stack(read, axis=1), ("x", "theta_p"), rates={})


def test_the_pole_stays_up_and_the_cart_sticks_at_every_turn():
    log = balanced_log()
    assert np.abs(log.measured[:, 1]).max() < 0.2 and 0.2 < np.ptp(log.measured[:, 0]) < 0.8
    assert np.mean(np.diff(log.measured[:, 0]) == 0.0) > 0.05


@pytest.mark.slow
def test_dry_friction_under_a_balanced_pole_is_named_alone():
    found = diagnose(Model.parse(MODEL), [balanced_log()])
    assert found.steps == ("coulomb_drive",)
    first = found.named[0]
    assert first.coefficients["torque"] == pytest.approx(DRY / GAIN, rel=0.06)
    assert first.error_after < 0.4 * found.error
