"""Accelerometers: what they weigh, what they show, and by how much they differ."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class AccelerometerType:
    """A kind of accelerometer (of that of a B&K 4507 B 004; 5 g with its share of the cable).

    Attributes
    ----------
    mass : [kg]; Echaniz Granado (2015), section 5.3
    sensitivity : [V s²/m]
    resonance, damping : of its seismic mass on its mounting [Hz], of critical
    noise : [m/s²/√Hz]
    gain_sd, gain_most : of the sensitivity, relative; "less than 3 %", section 4.2.2.3
    tilt_sd : from the direction it should have [rad]
    place_sd : from the place it should have, each way in the sheet [m]
    drive_offset : distance of the one at the drive point from the gauge [m], section 4.2.3.3
    """

    mass: float = 0.005
    sensitivity: float = 0.0102
    resonance: float = 18e3
    damping: float = 0.02
    noise: float = 4.4e-5
    gain_sd: float = 0.01
    gain_most: float = 0.03
    tilt_sd: float = 0.0175
    place_sd: float = 0.0015
    drive_offset: float = 0.015


def drawn_gains(kind: AccelerometerType, n: int, rng: np.random.Generator) -> np.ndarray:
    """True over stated sensitivity of n of them (n,), none beyond what the calibrator lets pass."""
    drawn = 1 + kind.gain_sd * rng.normal(size=n)
    return np.clip(drawn, 1 - kind.gain_most, 1 + kind.gain_most)


def shown(kind: AccelerometerType, s: np.ndarray) -> np.ndarray:
    """Ratio of shown to true acceleration, ω_0² / (s² + 2ζω_0 s + ω_0²) at s [rad/s]."""
    w = 2 * np.pi * kind.resonance
    return w**2 / (s**2 + 2 * kind.damping * w * s + w**2)
