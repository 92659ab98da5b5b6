"""CGAP in a linear solution, and PBUSH with RIGID."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.refusals import says

import chladni
from chladni.fem.assemble import structure
from chladni.fem.energy import rigid_motions
from chladni.io.nastran import assembly
from chladni.units import UNITS

MM = UNITS["mm-t-s"]
PAIR = """\
GRID,1,,0.,0.,0.
GRID,2,,{gap},0.,0.
CONM2,81,1,,1.-3,,,,,4.,,5.,,,6.
CONM2,82,2,,1.-3,,,,,4.,,5.,,,6.
"""
GAP = "CGAP,9,7,1,2,0.,1.,0.\n"
STATES = {  # N/mm along the gap and across it
    "closed": (",,1.+5", 1e5, 0.0),
    "closed with KT": (",,1.+5,,3.+4", 1e5, 3e4),
    "closed with friction": (",,1.+5,,,.2", 1e5, 2e4),
    "open": (".1,,1.+5,,3.+4", 1e-9, 0.0),
    "open with KB": (".1,5.,1.+5,20.,3.+4", 20.0, 0.0),
    "pressed together": ("-.1,,1.+5", 1e5, 0.0),
}


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("place", ["apart", "at one place"])
def test_a_gap_has_the_stiffness_of_its_state_at_rest(bulk, state, place):
    property, along, across = STATES[state]
    card = GAP if place == "apart" else "CGAP,9,7,1,2,,,,0\n"
    text = PAIR.format(gap=2.0 if place == "apart" else 0.0) + card + f"PGAP,7,{property}\n"
    made = assembly(bulk(text, fold=False), MM, loose=True)
    np.testing.assert_allclose(made.bushes.frame[0], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(made.bushes.stiffness[0] / 1e3, [along, across, across, 0, 0, 0])


def test_a_gap_across_any_direction_needs_no_orientation(bulk):
    text = PAIR.format(gap=2.0) + "CGAP,9,7,1,2\nPGAP,7,,,1.+5,,3.+4\n"
    assert assembly(bulk(text), MM, loose=True).bushes.stiffness[0, 2] == pytest.approx(3e7)
    says("CGAP 9: there is no PGAP 8; there are 7", assembly, bulk(text.replace("9,7", "9,8")), MM)


def tied(bulk, property, more=""):
    """Two bodies joined off their grids, each in axes of its own, at an offset from both."""
    text = PAIR.format(gap=20.0).replace("GRID,1,,0.,0.,0.", "GRID,1,,0.,0.,0.,4") + (
        "CORD2R,4,,0.,0.,0.,1.,2.,3.,\n,-2.,1.,.5\n"
        "CBUSH,9,7,1,2,,,,4\n,.3,0,3.,5.,-7.\n"
    )  # fmt: skip
    return assembly(bulk(f"{text}PBUSH,7,K,{property}\n{more}", fold=False), MM, loose=True)


@pytest.mark.parametrize("property", ["RIGID," * 6, ",RIGID,5.,,RIGID,", "RIGID"])
def test_rigid_components_do_not_move(bulk, property):
    """E q = 0 for every free motion, six rigid motions remain, and soft components are as stiff."""
    made = tied(bulk, property)
    built = structure(replace(made, auto_spc=False))
    words = property.split(",")
    rigid = [k for k, word in enumerate(words) if word == "RIGID"]
    assert len(built.system.dofs) == 12 - len(rigid)
    q = np.asarray(built.T.toarray())
    bush = made.bushes
    motion = q.reshape(2, 6, -1)
    at = [
        motion[k, :3] + np.cross(motion[k, 3:], (bush.place[0] - made.points[k])[:, None], axis=0)
        for k in (0, 1)
    ]
    delta = np.concatenate([bush.frame[0] @ (at[1] - at[0]),
                            bush.frame[0] @ (motion[1, 3:] - motion[0, 3:])])  # fmt: skip
    np.testing.assert_allclose(delta[rigid], 0, atol=1e-9)
    K = built.system.K.toarray()
    free = np.linalg.lstsq(q, rigid_motions(made), rcond=None)[0]
    np.testing.assert_allclose(q @ free, rigid_motions(made), atol=1e-9)
    np.testing.assert_allclose(K @ free, 0, atol=1e-9 * max(np.abs(K).max(), 1.0))


def test_rigid_is_the_limit_of_stiff(tmp_path):
    """Frequencies of a mass on a plate by a bush of 1e9 N/mm and by RIGID."""
    grids = "".join(f"GRID,{10 * j + i + 1},,{20.0 * i},{20.0 * j},0.\n"
                    for j in range(4) for i in range(4))  # fmt: skip
    quads = "".join(
        f"CQUAD4,{10 * j + i + 1},1,{10 * j + i + 1},{10 * j + i + 2},"
        f"{10 * j + i + 12},{10 * j + i + 11}\n"
        for j in range(3)
        for i in range(3)
    )
    text = grids + quads + "PSHELL,1,5,2.,5,,5\nMAT1,5,2.1+5,,.3,7.85-9\nGRID,99,,60.,60.,15.\n"
    text += "CONM2,98,99,,2.-5,,,,,1.-3,,1.-3,,,1.-3\nCBUSH,97,7,34,99,,,,0\n"
    text += "SPC1,1,123456,1,2,3,4\n"

    def found(word):
        path = tmp_path / "deck.bdf"
        path.write_text(f"SOL 103\nCEND\nSPC=1\nBEGIN BULK\n{text}PBUSH,7,K{word * 6}\n")
        return chladni.modes(path, 6, units="mm-t-s").frequency

    np.testing.assert_allclose(found(",RIGID"), found(",1.+9"), rtol=1e-4)


def test_damping_is_no_rigid_component(bulk):
    text = PAIR.format(gap=2.0) + "CBUSH,9,7,1,2,,,,0\nPBUSH,7,K,1.\n,,B,RIGID\n"
    says("CBUSH 9: B or GE is RIGID", assembly, bulk(text, fold=False), MM)
