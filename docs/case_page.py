"""``docs/case.md``, written from the table of the words a case may hold."""

import sys
from collections.abc import Sequence

from chladni.case.schema import COLUMNS, COMMANDS, SCHEMA, Key, sections


def page() -> str:
    """``docs/case.md``."""
    return "\n".join([_HEAD, *(_section(name) for name in sections()), _TAIL, _columns(), _FILES])


def _section(name: str) -> str:
    head = f"[[{name}]]" if name in ("parameter", "recording") else f"[{name}]"
    return f"## `{head}`\n\n{_table([k for k in SCHEMA if k.section == name])}"


def _columns() -> str:
    return f"## `sensors.csv`\n\n{_table(COLUMNS)}"


def _table(keys: Sequence[Key]) -> str:
    rows = ["| key | what | unit | default | meaning | example | used by |", "|" + "---|" * 7]
    for k in keys:
        what = f"{k.kind}: {', '.join(k.choices)}" if k.choices else k.kind
        used = "all commands" if k.used == COMMANDS else ", ".join(k.used)
        cells = (f"`{k.name}`", what, k.unit, k.default, k.meaning, f"`{k.example}`", used)
        rows.append("| " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


_HEAD = """\
# The case

A folder with one `case.toml` says what a model is compared with. Every command takes it. Words that
are not listed here are refused with the line they stand in. Words that a command makes no use of
are named in its notes. Numbers are SI whatever the deck is in. `chladni init DECK RECORDING` drafts
a case, `chladni check CASE` says how it is understood. This page is written from
`chladni/case/schema.py`.

Its files lie in its folder: a path that leads out of it is refused unless `[model] outside = true`
says that this is meant, so that a case from somebody else opens nothing of yours. `chladni init`
points to deck and recordings where they are and writes that word if they are elsewhere; copied into
the folder, they make a case that can be handed on. What a deck includes is the deck's own affair.

Files above 1 GB (an archive: unpacked) are refused before they are read; `CHLADNI_LARGEST_GB=8` in
the environment lets larger ones in. Results go to a folder of their own (`--out`), which holds
those of one command: a second run of it replaces what the first wrote, as `run.json` lists it, and
no other file. What is in the way is left alone and the results are kept beside it.

```toml
[model]
deck = "panel.bdf"
units = "mm-t-s"

[test]
recordings = ["panel.uff"]
sensors = "sensors.csv"
mass = 1.926

[band]
fit = [6.0, 30.0]

[[parameter]]
parts = ["panel"]
field = "E"
sd = 0.03
low = 0.9
high = 1.1
```
"""

_TAIL = """\
Without any `[[parameter]]`, E of every part of shells and beams, t of shells, the wall of tubes and
rho of every material are free; in a deck with neither, E and rho of every material of solids. Bars
between two spiders hold sheets together: they are joints, and are not freed by themselves.

What can be freed, and of what: E, rho, nu and t of isotropic shells; E, rho, t, E1, E2, G12 and
nu12 of orthotropic ones; E, rho and t of laminates (E is one factor on all moduli); E, rho and nu
of solids; E and rho of beams, and the wall of those that are closed tubes (one factor on A, I1, I2,
I12 and J, whatever card they stand in); K of springs (`PELAS`, `CELAS2`) and bushes (`PBUSH`); M of
`CONM2`.
`global-stiffness` and `part-stiffness` are E, `global-density` is rho, `thickness-scale` is t,
`adhesive-stiffness` is E of the solid parts named. `orthotropic-material`, `sensor-mass` and
`suspension` are freed as they are; they take no sd, low and high. So is `weld-patch`: one factor on
E of the shells about all welds of solids, and the radius of that patch. An effect whose place is
unknown is found by `diagnose` and cannot be freed here. Every change is written into the updated
deck.
"""

_FILES = """\
## Recordings

- FRF as `.csv`: columns `frequency_hz`, `output`, `input`, `real`, `imag`; optional `coherence` and
  `variance` (the noise), `level` and `article` (one recording each). In place of `real` and `imag`
  there may be `magnitude` and `phase_deg` or `phase_rad`.
- FRF as `.npz`: arrays `frequency_hz` (n_f,), `values` (n_f, n_out, n_in), `outputs`, `inputs`;
  optional `coherence`, `variance`, `quantity`, `level`, `article`.
- Where a table moves the supports, the input is `base:+X`, `base:+Y` or `base:+Z` and the quantity
  transmissibility, acceleration per acceleration (unit 1). All grids that the deck holds by SPC
  move together, and what is held to ground is held to them.
- Poles as `.csv`: columns `mode` and `frequency_hz`; optional `frequency_sd_hz`, `damping` (noted,
  never fitted), `state` (the first is compared, or the one `use` names).
- Time data, whose FRFs are estimated as `chladni test` does it (hits, bursts, multisines, random,
  stepped sine are told apart): universal file (58, function type 1); `.csv` with columns `time_s`,
  optional `block`, and one a channel headed `412:+Z [m/s^2]`; `.npz` and `.mat` (to version 7) with
  `rate` (`fs`, `dt`, `t`), `force` and `acceleration` (`velocity`, `displacement`), optional
  `inputs` and `outputs`, or `data`, `labels`, `units`, optional `roles`; `.mat` of Testlab; `.wav`.
- A table `NAME.channels.csv` beside time data names its channels: `channel`, `label`, `unit`,
  optional `role`, `scale`. A `.wav` needs it.
- Universal file: 58 and 58b FRFs and coherence, 15 and 2411 nodes, 2412 and 82 lines, 2420 the axes
  in which nodes measure, 55 shapes, 151 and 164 header and units; others are named and not used.

Several recordings are told apart by article, level and state, as the files or `[[recording]]` say.
Of one article, level and state, other shaker places are stacked as inputs of one test; the same
places again are repeats. Repeats and articles give a measured spread below which no fit is asked to
go; levels do not. The first is fitted, the others score the decks.
From three levels on `identify` and `diagnose` fit elements that friction, play and stretching are
known by (cubic spring, gap, slider, micro-slip, drag) to each mode's frequency and damping against
its amplitude, and from four on they foretell levels that are held out. Levels are amplitudes: of
one line of a stepped sine where `control` is `"response"`, else of the force. From two levels on
both show every mode at every level, amplitude, frequency and damping with 95 % intervals; JSON
holds that, and `identify` writes it as `levels.csv`.
States are one object changed: each is diagnosed with what the others say of E, rho and t, all are
then fitted at once with these shared, and each has its own effect, deck and page.

Time histories and spectra of responses, no force among them, give natural frequencies where a case
holds neither FRFs nor poles. What rings down (a record, or each of its blocks) is taken from its
loudest moment on; what goes on, as if the force were white in the band. The time data may be any of
those above without the force, and sound of a microphone (Pa); `identify` gives poles, damping and
unscaled shapes of what rings down. Elsewhere they, and mode shapes, are named in the notes and not
used.
"""


if __name__ == "__main__":  # python docs/case_page.py > docs/case.md
    sys.stdout.write(page())
