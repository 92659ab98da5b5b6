"""What a command says, where to; how it ends when it is ended, and what it leaves."""

import os
import re
import resource
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import pytest
import typer
from tests.builders.commands import call, ran, refused, spoken

from chladni.cli import console
from chladni.cli.app import commands, guarded
from chladni.cli.console import opened_console, plain_line, say, table_lines, watched
from chladni.errors import FileError, Interrupted
from chladni.output import run_folder, write_text
from chladni.report.blocks import Table

from .test_cli import OSCILLATOR, deck_text


@pytest.fixture
def deck(tmp_path):
    path = tmp_path / "one.bdf"
    path.write_text(OSCILLATOR)
    return path


def code_of(command):
    with pytest.raises(typer.Exit) as caught:
        guarded(command)()
    return caught.value.exit_code


def test_tables_are_said_with_all_their_numbers():
    table = Table(("part", "Hz"), [("a", "1.5"), ("longer", "22")], words=("part",))
    assert table_lines(table) == ["part     Hz", "a       1.5", "longer   22"]
    rows = [(str(k), "1") for k in range(60)]
    said = ("x" * 60, " ".join(["because"] * 30))
    lines = table_lines(Table(("what", "why"), [said], words=("what", "why")))[1:]
    assert lines[0].startswith(f"{said[0]}  because because")
    assert " ".join(" ".join(lines).split()) == " ".join(said)  # both cells are whole
    assert max(map(len, lines)) <= 60 + 2 + 110
    lines = table_lines(Table(("mode", "Hz"), rows), most=10)
    assert len(lines) == 12
    assert lines[-1] == "report.html has 50 more rows"


def test_energy_that_is_in_no_part_has_a_column_of_its_own(tmp_path, deck):
    """Shares of a row come to 100 %, where springs hold the plate as where none do."""
    for springs in ("", "CELAS2,91,1000.,1,3\nCELAS2,92,1000.,25,3\n"):
        deck.write_text(deck_text(4).replace("ENDDATA", f"{springs}ENDDATA"))
        done = call("modes", deck, "--units", "SI", "--count", 9, "--out", tmp_path / "out")
        assert ("springs, bushes" in done.stdout) == bool(springs)
        strain, _ = done.stdout.split("Effective modal mass")
        shares = [re.findall(r"([\d.]+) %", line) for line in strain.splitlines()]
        rows = [sum(map(float, row)) for row in shares if row]
        assert len(rows) == (5 if springs else 3)
        assert rows == pytest.approx([100.0] * len(rows), abs=0.11)


def test_verbose_and_log_tell_the_stages_and_what_was_said(deck, tmp_path):
    log, out = tmp_path / "run.log", tmp_path / "out"
    plain = call("modes", deck, "--out", out)
    done = call("modes", deck, "--verbose", "--log", log, "--out", out)
    assert done.exit_code == plain.exit_code == 0
    assert spoken(plain.stderr) == []
    assert "reading the model" in done.stderr
    assert done.stdout == plain.stdout
    text = log.read_text()
    assert all(line in text for line in plain.stdout.splitlines() if line)
    assert "reading the model" in text
    refused = call("modes", tmp_path / "none.bdf", "--log", log)
    assert refused.stderr.strip() in log.read_text()  # the log goes on, and holds the sentence


@pytest.mark.parametrize("there", [True, False])
def test_a_page_is_opened_only_where_that_is_asked_for(deck, tmp_path, monkeypatch, there):
    """The page in its place, not in the scratch folder; without a browser a note says so."""
    opened, out = [], tmp_path / "out"
    monkeypatch.setattr("webbrowser.open", lambda uri: opened.append(uri) or there)
    ran("modes", deck, "--out", out)
    assert opened == []
    done = ran("modes", deck, "--out", out, "--open")
    assert opened == [(out / "report.html").as_uri()]
    assert ("no browser opened" in done.stderr) != there


@pytest.mark.parametrize(
    ("words", "said", "more"),
    [
        (["modes", "x.bdf", "--cuont", "8"], "no such option: --cuont", "modes"),
        (["modes"], "missing argument 'DECK_or_CASE'", "modes"),
        (["modes", "x.bdf", "--count", "many"], "invalid value for '--count': ", "modes"),
        (["modes", "x.bdf", "y.bdf"], "too many words: y.bdf; ", "modes"),
        (["xy"], "no such command 'xy'; there are diagnose, init, check, convert, demo", ""),
        (["blind", "make", "--out", "x"], "missing option '--set'", "blind make"),
        (["blind", "xy"], "no such command 'xy'; there are make, run, score", "blind"),
    ],
)
def test_words_that_no_command_takes_are_one_sentence(words, said, more):
    done = call(*words)
    assert (done.exit_code, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"chladni: {said}")
    assert line.endswith(f"; see `{' '.join(['chladni', more]).strip()} --help`")


@pytest.mark.parametrize("words", [[], ["blind"], ["--help"], ["modes", "--help"]])
def test_who_asks_for_nothing_is_shown_the_help(words):
    done = call(*words)
    assert done.exit_code == (0 if "--help" in words else 2)
    assert (done.stdout + done.stderr).startswith("Usage: ")


def test_what_is_beside_the_missing_is_what_could_be_meant(tmp_path, monkeypatch):
    """Files and cases; no folder of results, though it has the nearest name."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pane").mkdir()
    (tmp_path / "panel").mkdir()
    (tmp_path / "panel" / "case.toml").write_text("")
    for command in ("modes", "check"):
        assert call(command, "pan").stderr.strip().endswith("the same folder has panel")


FULL = Path("/dev/full")


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
def test_a_log_on_a_full_disk_is_refused_at_once_and_ends_no_run(deck, tmp_path, capsys):
    nowhere = tmp_path / "no" / "folder.log"
    said = refused("modes", deck, "--log", nowhere, "--out", tmp_path / "o")
    assert said.startswith("chladni: --log ")
    said = refused("modes", deck, "--log", FULL, "--out", tmp_path / "o")
    assert said == f"chladni: --log {FULL} cannot be written: No space left on device"
    with opened_console(log=tmp_path / "log") as one:
        one.log.close()
        one.log = FULL.open("a", encoding="utf-8")  # from here on the disk is full
        say("worth a word")
        say("and another")
    found = capsys.readouterr()
    assert found.out == "worth a word\nand another\n"
    assert found.err == f"--log {FULL} ends here: No space left on device\n"


def test_memory_that_a_library_lacks_is_no_fault_of_ours(capsys):
    """A library that finds no room for itself is reported by an ImportError."""

    def command():
        raise ImportError("libx.so: failed to map segment from shared object")

    assert code_of(command) == 2
    assert capsys.readouterr().err == "chladni: there is not enough memory\n"


@pytest.mark.parametrize("words", [["--out", ""], ["--out="]])
def test_an_empty_folder_is_not_the_current_one(words, deck, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = ran("modes", deck, *words, code=2)
    assert "'--out': the name is empty" in done.stderr
    assert list(tmp_path.iterdir()) == [deck]


@pytest.mark.parametrize("x", ["nan", "inf", "1e400"])
def test_numbers_of_options_are_finite(deck, tmp_path, x):
    said = refused("identify", deck, "--pick", 3.0, "--pick", x, "--out", tmp_path / "o")
    assert said == f"chladni: --pick {float(x):g} is not a finite number"


@pytest.mark.skipif(sys.platform == "darwin", reason="names of files are UTF-8 there")
def test_a_deck_whose_name_is_no_text(deck, tmp_path):
    odd = deck.rename(os.fsdecode(os.fsencode(tmp_path) + b"/d\xff.bdf"))
    for k, words in enumerate((["modes", odd], ["frf", odd])):
        ran(*words, "--out", tmp_path / f"o{k}")
    said = refused("init", odd, "--units", "SI", "--out", tmp_path / "case")
    assert said.endswith("rename this file or its folder")


def test_the_list_of_commands_is_whole():
    for words in ([], ["blind"]):
        assert "..." not in call(*words, "--help").stdout.split("Commands:")[1]
    assert all(name in call("--help").stdout for name in commands())


def test_warnings_of_libraries_go_aside(capsys, tmp_path):
    with opened_console(log=tmp_path / "log"), warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.warn("divide by zero", RuntimeWarning, stacklevel=1)
    assert capsys.readouterr() == ("", "")
    assert "RuntimeWarning: divide by zero" in (tmp_path / "log").read_text()


def test_a_long_run_without_a_terminal_says_what_it_does(monkeypatch, capfd):
    monkeypatch.setattr(console, "QUIET", 0.05)
    monkeypatch.setattr(console, "AGAIN", 60.0)
    with opened_console(), watched() as progress:
        progress("modes of 12 dofs", 0.25)
        time.sleep(0.5)
    said = capfd.readouterr().err
    assert "modes of 12 dofs, 25 %" in said
    assert said.count("\n") == 1


def test_nothing_in_a_file_steers_the_terminal(capsys):
    say("\x1b[31mred\x07 \u202eright to left\tkept")
    assert capsys.readouterr().out == "?[31mred? ?right to left\tkept\n"
    with opened_console(verbose=True) as one:
        one.aside("a name\x1b[2J")
    assert capsys.readouterr().err.endswith("a name?[2J\n")
    assert plain_line("Ärger µm² – “q”") == "Ärger µm² – “q”"


def test_a_fault_of_ours_is_said_as_one(capsys):
    def command():
        raise KeyError("x")

    assert code_of(command) == 1
    said = capsys.readouterr().err
    assert said.startswith("chladni: an error in chladni, not in its input: KeyError")
    assert said.count("\n") == 1


def test_sigterm_clears_up_and_says_what_is_kept(tmp_path, capsys):
    def command():
        with run_folder(tmp_path / "out", "modes") as part:
            write_text(part / "half.txt", "half")
            try:
                os.kill(os.getpid(), signal.SIGTERM)
                time.sleep(5)
            except KeyboardInterrupt:
                raise Interrupted("3 of 9 samples are kept") from None

    before = signal.getsignal(signal.SIGTERM)
    assert code_of(command) == 130
    assert capsys.readouterr().err == "chladni: 3 of 9 samples are kept\n"
    assert not (tmp_path / "out").exists()
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("own", [ImportError, SystemError, FileError])
def test_a_library_that_makes_an_error_of_the_interruption_is_no_fault(number, own, capsys):
    """As VTK does of a signal that comes while it is imported."""

    def command():
        try:
            os.kill(os.getpid(), number)
            time.sleep(5)
        except KeyboardInterrupt as error:
            raise own("initialization failed") from error

    usual = signal.signal(signal.SIGINT, signal.default_int_handler)  # shells ignore it behind &
    before = signal.getsignal(number)
    try:
        assert code_of(command) == 130
        assert signal.getsignal(number) is before
    finally:
        signal.signal(signal.SIGINT, usual)
    assert capsys.readouterr().err == "chladni: interrupted; no file was written\n"


PLAIN = {**os.environ, "CHLADNI_GRAPHICS": "matplotlib"}
MAIN = [sys.executable, "-m", "chladni"]


def test_who_reads_may_leave(deck, tmp_path):
    """As `| head -1` does: the results are written, and nobody speaks of a pipe."""
    read, write = os.pipe()
    os.close(read)
    words = [*MAIN, "modes", str(deck), "--out", str(tmp_path / "out")]
    done = subprocess.run(words, stdout=write, stderr=subprocess.PIPE, text=True, env=PLAIN)
    os.close(write)
    assert (done.returncode, spoken(done.stderr)) == (0, [])
    assert (tmp_path / "out" / "modes.json").exists()


def test_a_full_disk_is_a_sentence_and_the_earlier_results_stay(deck, tmp_path):
    """The largest file allowed is smaller than a picture: a write fails half way."""
    out = tmp_path / "out"
    ran("modes", deck, "--out", out)
    before = {p.name: p.read_bytes() for p in out.iterdir()}

    def small() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))

    words = [*MAIN, "modes", str(deck), "--count", "1", "--out", str(out)]
    done = subprocess.run(words, capture_output=True, text=True, preexec_fn=small, env=PLAIN)
    assert done.returncode == 2, done.stderr
    (said,) = spoken(done.stderr)
    assert said.startswith("chladni: ")
    assert {p.name: p.read_bytes() for p in out.iterdir()} == before


def test_a_place_that_cannot_be_written_is_a_sentence(deck):
    """No user, root included, makes a folder in /proc."""
    if not Path("/proc").is_dir():
        pytest.skip("no /proc here")
    said = refused("modes", deck, "--out", "/proc/chladni")
    assert said.startswith("chladni: /proc/chladni: ")
    with pytest.raises(FileError), run_folder("/proc/self/task", "modes"):
        pass
