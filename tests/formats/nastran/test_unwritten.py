"""A changed model is written as it is, or refused: over every field of the assembly."""

from dataclasses import fields, replace

import numpy as np
import pytest

import chladni
from chladni.errors import ChladniError, ModelError
from chladni.io.nastran.edit.unwritten import refuse_unwritten
from chladni.model.assembly import Assembly

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


def moved(value, row=-1):
    """An array with one number of a row another, by 1 %, by one, or reversed."""
    out = np.array(value)
    if not out.size:
        return None
    at = (row, *(0,) * (out.ndim - 1))
    if out.dtype == bool:
        out[at] = ~out[at]
    elif np.issubdtype(out.dtype, np.integer):
        out[at] += 1
    else:
        out[at] = out[at] * 1.01 or 0.01
    return out


def less(value):
    return value[:-1] if len(value) else None


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


def reweighed(tie):
    """An RBE3 with another weight of its first term."""
    if not hasattr(tie, "terms"):
        return tie
    (row, components, weight), *rest = tie.terms
    return replace(tie, terms=((row, components, 2 * weight), *rest))


def refactored(tie):
    """An equation with another last factor."""
    if not hasattr(tie, "factors"):
        return tie
    return replace(tie, factors=(*tie.factors[:-1], 2 * tie.factors[-1]))


def variants(made: Assembly):
    """(name, assembly) of one change each, of every field and of every column of every family."""
    for f in fields(made):
        value = getattr(made, f.name)
        if f.name == "parts":
            for k, part in enumerate(value):
                for name, section in other(part.section):
                    parts = (*value[:k], replace(part, section=section), *value[k + 1 :])
                    yield f"part {part.id} {name}", replace(made, parts=parts)
            yield "name", replace(made, parts=(replace(value[0], name="other"), *value[1:]))
        elif f.name == "rigid":
            for k, tie in enumerate(value):
                yield (
                    f"without {type(tie).__name__}",
                    replace(made, rigid=value[:k] + value[k + 1 :]),
                )
            yield "weight", replace(made, rigid=tuple(map(reweighed, value)))
            yield "factor", replace(made, rigid=tuple(map(refactored, value)))
        elif f.name == "supports":
            yield "support dropped", replace(made, supports=value[:-1])
            yield "support added", replace(made, supports=np.vstack([value, [5, 3]]))
        elif f.name == "solids":
            for column in ("nodes", "part"):
                yield (
                    f"solids {column}",
                    replace(
                        made,
                        solids=(replace(value[0], **{column: moved(getattr(value[0], column))}),),
                    ),
                )
            yield "without solids", replace(made, solids=())
        elif hasattr(value, "ids"):
            yield (
                f"fewer {f.name}",
                replace(
                    made, **{f.name: type(value)(**{n: less(c) for n, c in vars(value).items()})}
                ),
            )
            for column in vars(value):
                if column == "part":
                    change = value.part[::-1] if len({*value.part}) > 1 else None
                elif column == "matrix":
                    change = 1.01 * value.matrix
                elif column in ("nodes", "node", "component"):
                    change = np.array(getattr(value, column))
                    change = change[..., ::-1] if change.ndim > 1 and column == "nodes" else None
                else:
                    change = moved(getattr(value, column))
                if change is not None:
                    yield (
                        f"{f.name} {column}",
                        replace(made, **{f.name: replace(value, **{column: change})}),
                    )
        elif isinstance(value, bool):
            yield f.name, replace(made, **{f.name: not value})
        elif isinstance(value, float):
            yield f.name, replace(made, **{f.name: value + 0.5})
        elif value is not None:
            yield f.name, replace(made, **{f.name: moved(value)})


def test_every_change_is_written_or_refused(model, tmp_path):
    """What the deck says after .write() is the model; else nothing is written, and it says why."""
    written, refused = set(), set()
    for k, (name, made) in enumerate(variants(model.assembly)):
        path = tmp_path / f"changed{k}.bdf"
        try:
            replace(model, assembly=made).write(path)
        except ChladniError:
            assert not path.exists(), name
            refused.add(name)
            continue
        found = chladni.load(path, "mm-t-s").assembly
        refuse_unwritten(model.assembly, made, found)
        with pytest.raises(ModelError, match="the deck cannot hold the change of its"):
            refuse_unwritten(model.assembly, made, model.assembly)
        written.add(name)
    assert {"part 1 membrane.E", "part 4 material.rho", "shells thickness", "springs value",
            "bushes stiffness", "masses matrix", "support dropped"} <= written  # fmt: skip
    assert {"points", "without RigidBody", "without Average", "without Equation", "weight",
            "factor", "support added", "fewer masses", "fewer springs", "fewer shells",
            "shells offset", "beams up", "k6rot", "auto_spc", "name",
            "axes"} <= refused  # fmt: skip


def test_the_same_model_is_written_word_for_word(model, tmp_path):
    model.write(tmp_path / "same.bdf")
    assert (tmp_path / "same.bdf").read_text() == DECK
