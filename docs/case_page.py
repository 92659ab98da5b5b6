"""``docs/case.md``, written from the table of the words a case may hold."""

import sys
from collections.abc import Sequence

from chladni.case.key import Key
from chladni.case.schema import COLUMNS, COMMANDS, SCHEMA, SECTIONS


def page() -> str:
    """``docs/case.md``."""
    return "\n".join([_HEAD, *(_section(name) for name in SECTIONS), _TAIL, _columns(), _FILES])


def _section(name: str) -> str:
    head = f"[[{name}]]" if name in ("parameter", "recording") else f"[{name}]"
    keys = [k for k in SCHEMA if k.section == name]
    example = "\n".join([head, *(f"{k.name} = {k.example}" for k in keys)])
    return f"## `{head}`\n\n{_table(keys)}\n{_used(keys)}\n```toml\n{example}\n```\n"


def _columns() -> str:
    example = "\n".join(",".join(getattr(k, of) for k in COLUMNS) for of in ("name", "example"))
    used = _used(COLUMNS)
    return f"## `sensors.csv`\n\n{_table(COLUMNS)}\n{used}\n```text\n{example}\n```\n"


def _table(keys: Sequence[Key]) -> str:
    rows = ["| key | value | default | meaning |", "|" + "---|" * 4]
    for k in keys:
        unit = f" [{k.unit}]" if k.unit else ""
        rows.append(
            f"| `{k.name}` | {k.in_words}{unit} | {k.default} | {k.meaning}{_argument(k)} |"
        )
    return "\n".join(rows) + "\n"


def _argument(key: Key) -> str:
    """The name in Python, where it is another one."""
    return f" In Python `{key.argument}`." if key.argument not in ("", key.name) else ""


def _used(keys: Sequence[Key]) -> str:
    """The commands that use each key, keys of the same commands together."""
    by: dict[tuple[str, ...], list[str]] = {}
    for k in keys:
        by.setdefault(k.used, []).append(f"`{k.name}`")
    whom = {used: "all commands" if used == COMMANDS else ", ".join(used) for used in by}
    return "".join(f"- Used by {whom[used]}: {', '.join(names)}.\n" for used, names in by.items())


_HEAD = """\
# The case

A folder with one `case.toml` says what a model is compared with. Every command takes it. A word
that is not listed here is refused with its line. A word that a command does not use is named in its
notes. Numbers are SI whatever the deck is in. The command `chladni init DECK RECORDING` drafts a
case. The command `chladni check CASE` says how it is understood. This page is written from
`chladni/case/schema.py`.

Its files lie in its folder. A path or a link that leads out of it is refused unless `[model]
outside = true` allows it, so that a case from somebody else opens nothing of yours. Files
that a deck or a thickness file includes are treated likewise. The command `chladni init` points to
deck and recordings where they are, and writes that word if they are elsewhere. Copied into the
folder, they make a case that can be handed on.

Text that a spreadsheet would take for a formula (`=`, `+`, `-` or `@` in front) is written with a
quotation mark in front, as in `'+Z`. Where a table is read, the mark is taken off.
Control characters are written as `\\x1b`.

Files above 1 GB (an archive: unpacked) are refused before they are read; `CHLADNI_LARGEST_GB=8` in
the environment lets larger ones in. Results go to a folder of their own (`--out`) with those of one
command. A second run replaces the files that the first wrote, as `run.json` lists them, and no
other file. A file that is in the way stays, and the results are kept next to it.

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

Each section below ends with an example of every word; no case needs them all.
"""

_TAIL = """\
Without `sd` the class of the material decides, recognised from the deck's E and rho:

| material | E | rho | t | wall |
|---|---|---|---|---|
| steel (185 to 220 GPa, 7600 to 8100 kg/m³) | 0.03 | 0.005 | 0.04 | 0.05 |
| aluminium alloys (65 to 76 GPa, 2600 to 2900 kg/m³) | 0.03 | 0.005 | 0.04 | 0.05 |
| others, solids, and bars that have no wall | 0.06 | 0.06 | 0.05 | 0.05 |

It is 0.1 for nu, 0.2 for nu12 and 0.3 for all else. The offset of a stiffener has half the
thickness of its sheet over the offset: some measure it from the middle of the sheet, some from its
face. Sources: JCSS (2001), Probabilistic Model Code, parts 2.1 and 3.2; ASM (1990), Metals
Handbook; EN 10131 and EN 485-4, whose limits count as two standard deviations. A sheet with paint
or sealant on it weighs more than its steel: give rho an `sd` that covers it.

Without any `[[parameter]]` these are free: E of every part of shells and beams, t of shells, the
wall of tubes, and rho of every material. Stiffeners on a sheet have their offset as well. A deck
with neither shells nor beams has all dimensions in its mesh. There E and rho of every material of
solids are free, those of steel and aluminium by 0.03 and 0.005. Bars between two spiders, and short
ones from sheet to sheet, hold sheets together. They are joints, and are not freed by
themselves.

| of | can be freed |
|---|---|
| isotropic shells | E, rho, nu, t |
| orthotropic shells | E, rho, t, E1, E2, G12, nu12 |
| laminates | E (one factor on all moduli), rho, t |
| solids | E, rho, nu |
| beams | E, rho; offset: one factor on `W1A` to `W3B` where they are given |
| closed tubes | wall: one factor on A, I1, I2, I12 and J, whatever card they stand in |
| springs (`PELAS`, `CELAS2`), bushes and connectors (`PBUSH`, `PBUSH1D`, `PWELD`, `PFAST`) | K |
| `CONM2` | M |

`global-stiffness` and `part-stiffness` are E, `global-density` is rho, `thickness-scale` is t,
`adhesive-stiffness` is E of the solid parts named. `orthotropic-material`, `sensor-mass` and
`suspension` are freed as they are. They take no sd, low and high. `weld-patch` takes none either:
it is one factor on E of the shells about all welds of solids, and the radius of that patch. An
effect whose place is unknown is found by `diagnose` and cannot be freed here. Every change is
written into the updated deck.
"""

_FILES = """\
## Recordings

- FRF as `.csv`: columns `frequency_hz`, `output`, `input`, `real`, `imag`; optional `coherence` and
  `variance` (the noise), `level` and `article` (one recording each). In place of `real` and `imag`
  there may be `magnitude` and `phase_deg` or `phase_rad`.
- FRF as `.npz` or `.mat`: arrays `frequency_hz` (n_f,), `values` (n_f, n_out, n_in), `outputs`,
  `inputs`; optional `coherence`, `variance`, `quantity`, `level`, `article`.
- A drive or a sensor at which the model does not respond is refused with its label. A support holds
  it, or its direction is uncoupled (a force in the plane of a flat sheet, sensors across it).
- Where a table moves the supports, the input is `base:+X`, `base:+Y` or `base:+Z` and the quantity
  transmissibility, acceleration per acceleration (unit 1). All grids that the deck holds by SPC
  move together, and so does everything that is held to ground.
- Tables are UTF-8, UTF-16 or CP1252, separated by commas, semicolons or tabs. Numbers have a
  decimal point. Where semicolons or tabs separate, they may have a decimal comma.
- Poles as `.csv`: columns `mode` and `frequency_hz`; optional `frequency_sd_hz`, `damping` (shown,
  never fitted), `state` (the first is compared, or the one `use` names).
- Modes with shapes (a modal model): dataset 55 of a universal file, OP2 and punch files (`.op2`,
  `.pch`). As `.csv`, as `identify` writes `shapes.csv`: columns `label`, `mode`, `frequency_hz`,
  `real`; optional `imag`, `real_sd`, `imag_sd`, `damping`, `frequency_sd_hz`. As `.npz` or `.mat`:
  arrays `frequency_hz` (r,), `shapes` (n_out, r), `outputs`; optional `damping`, `shapes_sd`,
  `frequency_sd_hz`.
- Time data, whose FRFs are estimated as `chladni test` does it. Hits, bursts, multisines, random
  and stepped sine are recognised.

  | file | time data in it |
  |---|---|
  | universal file | dataset 58, function type 1 |
  | `.csv` | `time_s`, optional `block`, and one column a channel, headed `412:+Z [m/s^2]` |
  | `.npz`, `.mat` | `rate` (`fs`, `dt`, `t`), `force`, `acceleration`; also `inputs`, `outputs` |
  | `.npz`, `.mat` | or `rate`, `data`, `labels`, `units`; optional `roles` |
  | `.mat` of Testlab, `.wav` | as they are |

  A `.mat` is read up to version 7. In place of `acceleration` there may be `velocity` or
  `displacement`.

- A table `NAME.channels.csv` next to time data names its channels: `channel`, `label`, `unit`,
  optional `role`, `scale`. A `.wav` needs it.
- Universal file: FRFs and coherence (58, 58b), nodes (15, 2411), lines (2412, 82), axes of nodes
  (2420), shapes (55), header and units (151, 164). Other datasets are named and not used. Shapes
  are used where the file has no FRFs.

Several recordings are distinguished by article, level and state, as the files or `[[recording]]`
say. For one article, level and state, other shaker places are stacked as inputs of one test. Equal
places are repeats. Repeats and articles give a measured spread, below which no fit has to go;
levels do not. The first is fitted, the others score the decks.

Shapes may have any scale and sign, real or complex; a complex shape is turned to be as real as it
can be. Files of one article, level and state are set-ups of one test, as are shapes of one file at
different nodes. They need channels in common, and are merged by these. The scatter there is the
standard deviation of the shapes, unless `shape_sd` or the file states one; else it is learned.
Close modes may mix: between these the subspace counts, and no shape of its own.

From three levels on `identify` and `diagnose` fit elements of friction, play and stretching to each
mode: cubic spring, gap, slider, micro-slip, drag. From four on they predict levels that are held
out. Levels are amplitudes: of one line of a stepped sine where `control` is `"response"`, else of
the force. From two levels on both show every mode at every level: amplitude, frequency and damping
with 95 % intervals. JSON holds that, and `identify` writes it as `levels.csv`.

States are one object changed. Each is diagnosed with the information of the others on E, rho and t.
All are then fitted at once with these shared. Each has its own effect, deck and page.

A later recording of the same object can build on an answer: `chladni diagnose CASE --earlier RUN`,
`earlier="RUN"` in Python. The odds of the effects at the places where that run found them, their
parameters and E, rho and t become the prior. The case then holds what was measured since: responses
that the earlier answer used are refused, and its weighing is not used again. Correlations between
parameters are lost. A case with all recordings of one state together keeps them.

Time histories and spectra of responses without a force give natural frequencies where a case holds
neither FRFs nor poles. A decay (a record, or each of its blocks) is used from its loudest moment
on. A steady signal is used as if the force were white in the band. The time data may be any of
those above without the force, and sound of a microphone (Pa). The command `identify` gives poles,
damping and unscaled shapes of decays. Elsewhere they are named in the notes and not used.
"""


if __name__ == "__main__":  # python docs/case_page.py > docs/case.md
    sys.stdout.write(page())
