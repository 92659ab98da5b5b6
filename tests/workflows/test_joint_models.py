"""Models of joints compared: the one the article has predicts held-out data best."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from tests.builders.recordings import noisy
from typer.testing import CliRunner

from chladni.case import load_case
from chladni.cli.app import application
from chladni.effects.joint_variants import joint_variants
from chladni.errors import FileError, LabelError
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.workflows.frf import frf
from chladni.workflows.joint_models import joint_models, with_joints
from chladni.workflows.loaded_model import load_model
from chladni_evidence.recovery import panel
from chladni_specimens.plates import plate

BAND = (20.0, 220.0)
TRUTH = "screws on RBE3"


def write_case(folder, deck, article):
    """A deck and the responses of an article on the same grids, with 1 % noise."""
    write_assembly(deck, folder / "panel.bdf")
    write_assembly(article, folder / "article.bdf")
    grids = deck.ids[np.unique(deck.shells.nodes)][::30]
    outputs = [f"{g}:+Z" for g in grids]
    lines = np.arange(BAND[0] - 5, BAND[1] + 80, 1.0)
    model = load_model(folder / "article.bdf", "SI")
    H = frf(model, outputs, outputs[:1], lines).frfs[0].to("accelerance")
    write_npz(folder / "frf.npz", replace(H, values=noisy(H.values, 0.01, 3)))
    (folder / "case.toml").write_text(
        '[model]\ndeck = "panel.bdf"\nunits = "SI"\n[test]\nrecordings = ["frf.npz"]\n'
        f"[band]\nfit = [{BAND[0]}, {BAND[1]}]\n[held_out]\nband = [220.0, 290.0]\n"
        '[[parameter]]\nfield = "E"\nparts = ["lower", "upper"]\nname = "E sheets"\n'
    )
    return folder


@pytest.fixture(scope="module")
def welded(tmp_path_factory):
    deck = panel(0.05)
    made = {v.name: v.assembly for v in joint_variants(deck)}
    return write_case(tmp_path_factory.mktemp("welded"), deck, made[TRUTH])


def test_the_model_of_the_article_is_the_best(welded, monkeypatch):
    """Its screw holds its rims softly; that model is chosen on unseen data, others say why not."""
    few = [v for v in joint_variants(load_case(welded).assembly)
           if v.name in ("deck", "welds rigid", TRUTH)]  # fmt: skip
    monkeypatch.setattr("chladni.workflows.joint_models.joint_variants", lambda assembly: few)
    result = CliRunner().invoke(application(), ["calibrate", str(welded), "--variants", "--out",
                                      str(welded / "out")])  # fmt: skip
    assert result.exit_code == 0, result.output
    found = json.loads((welded / "out" / "variants.json").read_text())
    assert found["best"] == TRUTH
    rows = {r["name"]: r for r in found["rows"]}
    assert "would follow two rigid bodies" in rows["welds rigid"]["refused"]
    assert rows[TRUTH]["held_out"]["calibrated"] < 0.5 * rows["deck"]["held_out"]["calibrated"]
    assert f"The deck with {TRUTH} predicts the held-out data best" in result.output
    assert (welded / "out" / "screws_on_RBE3.bdf").is_file()


def test_parts_keep_their_names_and_parameters(welded):
    """A variant is the same case with another deck: the free parameters are the same."""
    case = load_case(welded)
    other = with_joints(case, joint_variants(case.assembly)[1].assembly)
    assert [p.parts for p in other.parameters] == [p.parts for p in case.parameters]
    E = [[c.assembly.parts[k].name for k in c.parameters[0].positions] for c in (case, other)]
    assert E[0] == E[1]


def test_a_parameter_of_a_joint_that_is_gone_refuses_the_row(welded, tmp_path):
    """Springs have no E: that row says so, the others are fitted."""
    shutil.copytree(welded, tmp_path / "case")
    with (tmp_path / "case" / "case.toml").open("a") as text:
        text.write('[[parameter]]\nfield = "adhesive-stiffness"\nparts = ["glue"]\n')
    case = load_case(tmp_path / "case")
    made = {v.name: v.assembly for v in joint_variants(case.assembly)}
    with pytest.raises(LabelError, match="no part 'glue'"):
        with_joints(case, made["adhesive as springs"])


def test_a_deck_without_joints_is_refused(tmp_path):
    """One sentence: which joints have other models."""
    flat = plate(0.3, 0.2, 12, 9, 1e-3)
    folder = tmp_path
    write_case(folder, panel(0.05), panel(0.05))
    write_assembly(flat, folder / "panel.bdf")
    (folder / "case.toml").write_text((folder / "case.toml").read_text().split("[[parameter]]")[0])
    with pytest.raises(FileError, match="no welds or adhesive of solids and no screws"):
        joint_models(folder)
