"""A changed model is written as it is, or refused: over every field of the assembly."""

from dataclasses import fields, replace

import numpy as np
import pytest
from tests.builders.refusals import says

import chladni
from chladni.errors import ChladniError
from chladni.io.nastran.edit.unwritten import refuse_unwritten
from chladni.model.assembly import Assembly, RigidBody, Rotors, picked

DECK = """SOL 103
CEND
SPC = 1
MPC = 5
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,100.,0.,0.
GRID,3,,100.,100.,0.
GRID,4,,0.,100.,0.
GRID,5,,200.,0.,0.
GRID,6,,200.,100.,0.
GRID,11,,0.,0.,50.
GRID,12,,100.,0.,50.
GRID,13,,100.,100.,50.
GRID,14,,0.,100.,50.
GRID,21,,300.,0.,0.
GRID,22,,300.,100.,0.
GRID,23,,300.,50.,20.
GRID,31,,0.,0.,90.,9
CORD2R,9,,0.,0.,0.,1.,1.,1.
,1.,0.,0.
SPOINT,90
CQUAD4,1,1,1,2,3,4
CQUAD4,2,2,2,5,6,3
CHEXA,11,3,1,2,3,4,11,12
,13,14
CBAR,21,4,5,21,0.,0.,1.
CBAR,22,4,6,22,0.,0.,1.
CELAS2,31,100.,90,,2,3
CDAMP2,32,.1,90,,3,3
CMASS2,33,1.-4,90
CBUSH,34,7,13,31,,,,0
PBUSH,7,K,10.,10.,10.,1.+4,1.+4,1.+4
CONM2,41,22,,1.-3
CONM2,42,31,,1.-3
RBE2,51,21,123456,22
RBE3,52,,23,123456,1.,123456,21,22
MPC,5,12,1,1.,11,1,-1.
PSHELL,1,1,2.,1,,1
PSHELL,2,1,3.,1,,1
PSOLID,3,2
PBAR,4,1,100.,800.,900.,1500.
MAT1,1,2.1+5,,.3,7.85-9
MAT1,2,2000.,,.3,1.2-9
SPC1,1,123,1,4
ENDDATA
"""


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "deck.bdf"
    path.write_text(DECK)
    return chladni.load(path, "mm-t-s")


def moved(value):
    """An array with one number of its last row another, by 1 %, by one, or reversed."""
    out = np.array(value)
    at = (-1, *(0,) * (out.ndim - 1))
    if out.dtype == bool:
        out[at] = ~out[at]
    elif np.issubdtype(out.dtype, np.integer):
        out[at] += 1
    else:
        out[at] = out[at] * 1.01 or 0.01
    return out


def other(section):
    """Sections with one number another, field by field."""
    for f in fields(section):
        value = getattr(section, f.name)
        if isinstance(value, bool):
            yield f.name, replace(section, **{f.name: not value})
        elif isinstance(value, float) and f.name != "thickness":
            yield f.name, replace(section, **{f.name: value * 1.02 or 0.01})
        elif hasattr(value, "E"):
            for part in ("E", "nu", "rho", "damping"):
                changed = replace(value, **{part: getattr(value, part) * 1.02 or 0.01})
                yield f"{f.name}.{part}", replace(section, **{f.name: changed})


def other_tie(tie):
    """An RBE3 with another weight of its first term, an equation with another last factor."""
    if hasattr(tie, "terms"):
        (row, components, weight), *rest = tie.terms
        return replace(tie, terms=((row, components, 2 * weight), *rest))
    return replace(tie, factors=(*tie.factors[:-1], 2 * tie.factors[-1]))


def other_table(table):
    """A family with one element less, and with one number of each column another."""
    yield "ids", type(table)(**{n: c[:-1] for n, c in vars(table).items()})
    for column, value in vars(table).items():
        if column == "part":
            change = value[::-1] if len({*value}) > 1 else None
        elif column == "matrix":
            change = 1.01 * value
        elif column in ("nodes", "node", "component"):
            change = value[..., ::-1] if value.ndim > 1 and column == "nodes" else None
        else:
            change = moved(value) if value.size else None
        if change is not None:
            yield column, replace(table, **{column: change})


def variants(made: Assembly):
    """(what, its other value) of one change each, of every field of an assembly."""
    for f in fields(made):
        value = getattr(made, f.name)
        if f.name == "parts":
            for k, part in enumerate(value):
                for name, section in other(part.section):
                    new = replace(part, section=section)
                    yield f"parts {part.id} {name}", (*value[:k], new, *value[k + 1 :])
            yield "parts name", (replace(value[0], name="other"), *value[1:])
        elif f.name == "rigid":
            for k, tie in enumerate(value):
                yield f"rigid without {type(tie).__name__}", value[:k] + value[k + 1 :]
                if type(tie) is not RigidBody:
                    yield (
                        f"rigid {type(tie).__name__}",
                        (*value[:k], other_tie(tie), *value[k + 1 :]),
                    )
        elif f.name == "supports":
            yield "supports dropped", value[:-1]
            yield "supports added", np.vstack([value, [5, 3]])
        elif f.name == "solids":
            for column in ("nodes", "part"):
                yield (
                    f"solids {column}",
                    (replace(value[0], **{column: moved(getattr(value[0], column))}),),
                )
            yield "solids without", ()
            yield "solids doubled", (picked(value[0], np.r_[: len(value[0]), 0]), *value[1:])
        elif f.name == "rotors":
            yield f.name, Rotors(np.array([1]), np.array([0]), np.array([[0.0, 0.0, 0.02]]))
        elif hasattr(value, "ids"):
            for column, table in other_table(value):
                yield f"{f.name} {column}", table
            yield f"{f.name} fewer", picked(value, np.arange(len(value) - 1))
        elif isinstance(value, bool):
            yield f.name, not value
        elif isinstance(value, float):
            yield f.name, value + 0.5
        elif value is not None:
            yield f.name, moved(value)


WRITTEN = {"parts 1 membrane.E", "parts 4 material.rho", "shells thickness", "springs value",
           "bushes stiffness", "masses matrix", "supports dropped"}  # fmt: skip
REFUSED = {"points", "rigid without RigidBody", "rigid without Average", "rigid without Equation",
           "rigid Average", "rigid Equation", "supports added", "masses ids", "springs ids",
           "shells ids", "shells offset", "beams up", "k6rot", "auto_spc", "parts name",
           "axes", "solids doubled", "beams fewer", "shells fewer"}  # fmt: skip


def test_every_change_is_written_or_refused(model, tmp_path):
    """What the deck says after .write() is the model; else nothing is written, and it says why."""
    written, refused = set(), set()
    for k, (name, value) in enumerate(variants(model.assembly)):
        made = replace(model.assembly, **{name.partition(" ")[0]: value})
        path = tmp_path / f"changed{k}.bdf"
        try:
            replace(model, assembly=made).write(path)
        except ChladniError:
            assert not path.exists(), name
            refused.add(name)
            continue
        found = chladni.load(path, "mm-t-s").assembly
        refuse_unwritten(model.assembly, made, found)
        said = "the deck cannot hold the change of its"
        says(said, refuse_unwritten, model.assembly, made, model.assembly)
        written.add(name)
    assert written >= WRITTEN
    assert refused >= REFUSED


def test_the_same_model_is_written_word_for_word(model, tmp_path):
    model.write(tmp_path / "same.bdf")
    assert (tmp_path / "same.bdf").read_text() == DECK
