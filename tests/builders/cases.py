"""Small cases: a plate with a mass in one corner, recorded on the model's own responses."""

import shutil

import chladni
from chladni.geometry.refine import refined
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.model.point_masses import with_masses
from chladni_specimens.plates import plate

SENSORS = (2, 4, 7, 18, 30, 43)
NINE = (2, 4, 7, 18, 24, 30, 36, 43, 47)
CASE = """
[model]
deck = "plate.bdf"
units = "SI"
damping = 0.01
[test]
recordings = ["{recording}"]
{mass}
[band]
fit = [{low}, {top}]
"""


def case_text(low, top, mass=None, recording="frf.npz"):
    """The words of a case of plate.bdf in SI, a weighed mass among them where one is given."""
    weighed = "" if mass is None else f"mass = {mass}"
    return CASE.format(recording=recording, mass=weighed, low=low, top=top)


def changed_case(source, to, *words):
    """A copy of the folder of a case, with (old, new) words of its case.toml; its folder."""
    shutil.copytree(source, to, ignore=shutil.ignore_patterns("out", "identified"))
    text = (to / "case.toml").read_text()
    for old, new in words:
        assert old in text
        text = text.replace(old, new)
    (to / "case.toml").write_text(text, encoding="utf-8")
    return to


def write_case(folder, shells, sensors, frequency, top, lump=0.02, halved=0):
    """A plate of so many shells a side with a mass on its last corner, which the deck lacks.

    No two modes of the plate are alike, and none has a node at the shaker.  The shells of the
    article are halved so many times.
    """
    deck, corner = plate(0.3, 0.22, shells, shells, 1e-3), (shells + 1) ** 2
    write_assembly(deck, folder / "plate.bdf")
    heavier = with_masses(deck, (corner,), lump)
    for _ in range(halved):
        heavier = refined(heavier)
    write_assembly(heavier, folder / "article.bdf")
    article = chladni.load(folder / "article.bdf", "SI")
    made = chladni.frf(article, [f"{g}:+Z" for g in sensors], ["2:+Z"], frequency).frfs[0]
    write_npz(folder / "frf.npz", made.to("accelerance"))
    mass = round(chladni.modes(article, 7).mass, 5)
    (folder / "case.toml").write_text(case_text(20.0, top, mass))
