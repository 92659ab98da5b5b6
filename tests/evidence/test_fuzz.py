"""Injured inputs end in a sentence or a result; what does not is called by its name and kept."""

import sys

import pytest

import chladni_evidence.fuzz as fuzzing
from chladni_evidence.__main__ import main
from chladni_evidence.fuzz import DUE, fuzz, outcome
from chladni_evidence.fuzz_input import YOURS, FuzzInput
from chladni_evidence.fuzz_inputs import KINDS, fuzz_inputs

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs processes that fork")
GOOD = "BEGIN BULK\nSPOINT,1\nCELAS4,1,1000.,1\nCMASS4,2,1.,1\nENDDATA\n"


def test_an_injured_input_of_every_kind(tmp_path):
    """The same as the evidence run of ten thousand: python -m chladni_evidence fuzz."""
    said, inputs = [], (one for kind in KINDS for one in fuzz_inputs(1, 11, [kind]))
    counts = fuzz(inputs, tmp_path, said.append)
    wrong = {n: c for count in counts.values() for n, c in count.items() if n not in DUE}
    assert not wrong, said
    assert {kind: sum(count.values()) for kind, count in counts.items()} == dict.fromkeys(KINDS, 1)
    assert sum(count["refused"] for count in counts.values()) > 5  # the injuries are felt


def test_the_same_seed_makes_the_same_inputs():
    first, again, other = (
        [one.files for one in fuzz_inputs(12, seed, KINDS)] for seed in (1, 1, 2)
    )
    assert first == again
    assert first != other


def test_it_stops_in_time_and_counts_what_it_tried(tmp_path, monkeypatch):
    clock = iter([0.0, 10.0, 50.0, 61.0, 62.0])
    monkeypatch.setattr(fuzzing.time, "monotonic", lambda: next(clock))
    assert len(list(fuzzing.until(fuzz_inputs(12, 1, KINDS), 1.0))) == 2


BREAKS = {  # a command, put in the place of chladni, that breaks a rule
    "traceback": "raise KeyError('x')",
    "no sentence": "import sys; print('what?', file=sys.stderr); raise SystemExit(2)",
    "noise": "import os; os.mkdir('out'); open('out/a','w'); import sys; sys.stderr.write('hm')",
    "half-written": "import os, sys; os.mkdir('out'); sys.stderr.write('chladni: no'); sys.exit(2)",
    "nan written": "import os; os.mkdir('out'); open('out/a.json', 'w').write('[NaN]')",
    "nothing written": "import os; os.mkdir('out')",
    "programmer's words": "import sys; sys.stderr.write(\"chladni: ['a']\"); sys.exit(2)",
    "ended by signal 11": "import os, faulthandler as f; f.disable(); os.kill(os.getpid(), 11)",
    "hang": "while True: pass",
    "memory": "",
}


@pytest.mark.parametrize("called", BREAKS)
def test_what_breaks_a_rule_is_told_and_kept(called, tmp_path, monkeypatch):
    import runpy

    monkeypatch.setattr(runpy, "run_module", lambda *_, **__: exec(BREAKS[called]))
    if called == "memory":
        monkeypatch.setattr(fuzzing, "MEMORY", 1e6)
    one = FuzzInput("deck", {"a.bdf": GOOD.encode()}, ("modes", "a.bdf"))
    found = outcome(one, patience=1.0 if called == "hang" else 60.0)
    assert (found.called, found.good) == (called, False)
    if called == "traceback":
        counts = fuzz([one], tmp_path, lambda text: None)
        assert counts["deck"]["traceback"] == 1
        (kept,) = (p for p in tmp_path.iterdir() if p.is_dir())
        assert (kept / "a.bdf").read_text() == GOOD
        assert (kept / "command.txt").read_text().startswith("chladni modes a.bdf --out out\n")


@pytest.mark.parametrize(("said", "called"), [("it is conjugated", "answered"), ("fine", "silent")])
def test_an_answer_without_the_cause_of_a_contradiction_is_silent(said, called, monkeypatch):
    import runpy

    code = f"import os; os.mkdir('out'); open('out/a', 'w'); print({said!r})"
    monkeypatch.setattr(runpy, "run_module", lambda *_, **__: exec(code))
    one = FuzzInput("contradictory", {}, ("check", "."), cause="conjugated|unlike")
    assert outcome(one).called == called


def test_a_sound_deck_written_otherwise_is_answered(tmp_path):
    """Encoded, cut down, included: what is refused there is a fault, and no injury."""
    counts = fuzz(fuzz_inputs(4, 3, ["recoded"]), tmp_path, lambda text: None)
    assert counts == {"recoded": {"answered": 4}}
    no = FuzzInput("recoded", {"a.bdf": b"BEGIN BULK\nXYZ,1\n"}, ("modes", "a.bdf"), sound=True)
    assert outcome(no).called == "sound, and not answered"


SAY = "import sys; sys.stderr.write('chladni: '"


@pytest.mark.parametrize(
    ("code", "called"),
    [
        (f"{SAY} + open('a').read()); sys.exit(2)", "told of outside"),
        ("open('a', 'a').write('x'); import os; os.mkdir('out')", "touched outside"),
        (f"{SAY} + 'no'); sys.exit(2)", "refused"),
    ],
)
def test_what_follows_a_link_is_told(code, called, monkeypatch):
    import runpy

    monkeypatch.setattr(runpy, "run_module", lambda *_, **__: exec(code))
    one = FuzzInput("links", {}, ("modes", "a"), {"a": f"../{YOURS}/v1"})
    assert outcome(one).called == called


def test_an_unknown_kind_is_refused(tmp_path, capsys):
    assert main(["fuzz", "--kinds", "poem", "--out", str(tmp_path)]) == 2
    assert "no kind poem; there are deck" in capsys.readouterr().err


@pytest.mark.parametrize("said", ["GRID [: ID is '[', not an integer", "too many words: (' OR 8)"])
def test_what_the_user_wrote_is_no_programmers_word(said, tmp_path, monkeypatch):
    import runpy

    code = f"import sys; sys.stderr.write({'chladni: ' + said!r}); sys.exit(2)"
    monkeypatch.setattr(runpy, "run_module", lambda *_, **__: exec(code))
    assert outcome(FuzzInput("deck", {}, ("modes", "a.bdf"))).called == "refused"
