"""Recordings of plates by a mesh twice as fine as their deck, and cases of them."""

import json
from dataclasses import replace

import numpy as np
from tests.builders.recordings import noisy

import chladni
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.model.point_masses import with_masses
from chladni_specimens.plates import plate

SENSORS = [(0.0, 0.11), (0.05, 0.22), (0.15, 0.11), (0.2, 0.1833), (0.25, 0.0), (0.3, 0.22)]
SHAKERS = [(0.0, 0.0), (0.3, 0.0367)]
PLACE, MASS, T = (0.25, 0.1833), 0.02, 1.015e-3
DECK = plate(0.3, 0.22, 6, 6, 1e-3)
HEAD = """[model]
deck = "plate.bdf"
units = "SI"
[test]
mass = {mass}
[band]
fit = [20.0, 190.0]
"""


def at(assembly, places):
    away = np.linalg.norm(assembly.points[None, :, :2] - np.asarray(places)[:, None], axis=2)
    return tuple(int(assembly.ids[k]) for k in away.argmin(axis=1))


def labels(assembly, places):
    return tuple(f"{g}:+Z" for g in at(assembly, places))


def record(path, t=T, mass=0.0, shakers=SHAKERS[:1], seed=0):
    """Accelerances of a plate by a mesh twice as fine, 0.5 % noise; what it weighs [kg]."""
    article = plate(0.3, 0.22, 12, 12, t)
    if mass:
        article = with_masses(article, at(article, [PLACE]), mass)
    write_assembly(article, path.with_suffix(".bdf"))
    model = chladni.load(path.with_suffix(".bdf"), "SI")
    ends, drives = (list(labels(article, p)) for p in (SENSORS, shakers))
    H = chladni.frf(model, ends, drives, np.linspace(15, 230, 450)).frfs[0].to("accelerance")
    values = noisy(H.values, 0.005, seed)
    named = labels(DECK, SENSORS), labels(DECK, shakers)
    write_npz(path, replace(H, values=values, outputs=named[0], inputs=named[1]))
    return round(chladni.modes(model, 7).mass, 5)


def a_case(folder, mass, *recordings, tried=()):
    """A case.toml with these [[recording]] and, if any are given, effects that are tried."""
    write_assembly(DECK, folder / "plate.bdf")
    more = ["[[recording]]\n" + "\n".join(f"{k} = {json.dumps(v)}" for k, v in r.items())
            for r in recordings]  # fmt: skip
    search = f"[search]\neffects = {list(tried)}\n" if tried else ""
    (folder / "case.toml").write_text("\n".join([HEAD.format(mass=mass) + search, *more, ""]))
    return chladni.load_case(folder)
