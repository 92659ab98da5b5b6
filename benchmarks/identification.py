"""Speed of identification against sdypy-EMA, in one run: python benchmarks/identification.py.

Accelerances of known modes on an even grid with 2 % of noise, channels x lines as asked for. The
peer's least-squares complex frequency method runs to order 60; of its last order the poles nearest
to the true ones are taken, which helps it. Ours finds, selects and weighs alone, residues too.
"""

import argparse
import contextlib
import importlib.util
import io

import numpy as np
from threadpoolctl import threadpool_limits

from chladni.dynamics.frf import FRF
from chladni.ema.identification import identify
from chladni_evidence.identification_evidence import BAND, NOISE, structure
from timing import timed

ORDER = 60


def responses(channels: int, lines: int, modes: int) -> tuple[FRF, np.ndarray]:
    """A recording, and its poles within the band."""
    known, rng = structure(0, modes, channels), np.random.default_rng(0)
    f = np.linspace(0, BAND[1], lines + 1)[1:]  # the peer wants an even grid from zero
    H = known.accelerance(f)[:, :, None]
    sd = NOISE * np.abs(H)
    noise = rng.normal(size=(2, *H.shape)) / np.sqrt(2)
    labels = tuple(f"{k + 1}:+Z" for k in range(channels))
    values = H + sd * (noise[0] + 1j * noise[1])
    return FRF(values, f, labels, labels[:1], "accelerance", variance=sd**2), known.inside


def peer(frf: FRF) -> np.ndarray:
    """Poles [rad/s] of sdypy-EMA's LSCF at order 60."""
    from sdypy import EMA

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        model = EMA.Model(
            frf=frf.values[:, :, 0].T, freq=frf.frequency, lower=BAND[0], upper=BAND[1],
            pol_order_high=ORDER, frf_form="accelerance",
        )  # fmt: skip
        model.get_poles(show_progress=False)
    poles = np.asarray(model.all_poles[-1], complex)
    return poles[poles.imag > 0]


def error(poles: np.ndarray, due: np.ndarray) -> tuple[float, float]:
    """Worst error of frequency and of damping of the nearest poles, in per cent."""
    p = poles[np.abs(poles[:, None] - due).argmin(axis=0)]
    f = np.abs(np.abs(p) / np.abs(due) - 1).max()
    z = np.abs((p.real / np.abs(p)) / (due.real / np.abs(due)) - 1).max()
    return 100 * float(f), 100 * float(z)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", default="30x900,100x5000,500x20000", help="channels x lines")
    parser.add_argument("--modes", type=int, default=15)
    args = parser.parse_args()
    print(f"{'size':>12}{'':>12}{'CPU [s]':>10}{'x ours':>8}{'df [%]':>10}{'dzeta [%]':>11}")
    for size in args.sizes.split(","):
        channels, lines = map(int, size.split("x"))
        frf, due = responses(channels, lines, args.modes)
        with threadpool_limits(1):
            ours, found = timed(lambda frf=frf: identify(frf, BAND), 1)
            rows = [("chladni", ours, found.poles)]
            if importlib.util.find_spec("sdypy"):
                rows.append(("sdypy-EMA", *timed(lambda frf=frf: peer(frf), 1)))
        for name, seconds, poles in rows:
            f, z = error(poles, due)
            print(f"{size:>12}{name:>12}{seconds:10.2f}{seconds / ours:8.2f}{f:10.4f}{z:11.3f}")


if __name__ == "__main__":
    main()
