"""The page of the thesis' chapter: every table and figure of it next to our own."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chladni.report.blocks import Block, Facts, PageParts, Picture, Section, Table, Text
from chladni.report.words import hertz, number
from chladni_bench import DAMPING, FREQUENCIES, WEIGHTS

from .thesis_bench import ThesisTest
from .thesis_findings import BANDS, ThesisFindings, dispersion
from .thesis_modes import BAND, CORDS, spread

READING = ("statement of the thesis", "thesis", "ours")
RANGES = ((10, 60, 0.7), (60, 100, 1.9), (100, 156, 2.3), (156, 200, 1.0))  # of table 5: Hz, %


def thesis_page(pictures: dict[str, Path], test: ThesisTest, found: ThesisFindings) -> PageParts:
    """Sections of the page, tables first as in the thesis."""
    sections = [
        Section("Test article and schedule", [Facts(_facts(test, found)), Text(_TESTED)]),
        Section("Table 3: the schedule of the stepped sine", _schedule(found)),
        Section("Table 4: mass", _masses(found)),
        Section("Table 5: natural frequencies", _frequencies(found)),
        Section("Table 6: damping", _damping(found)),
        Section("Figure 19: the cords", [Picture(pictures["19"]), *_cords(found)]),
        Section("Figure 23: Nyquist", [Picture(pictures["23"]), *_circles(found)]),
        Section("Figure 24: three levels", [Picture(pictures["24"]), *_levels(found)]),
        Section("Figure 25: three articles", [Picture(pictures["25"]), *_articles(found)]),
        Section("Figure 26: two excitations", [Picture(pictures["26"]), *_excitations(found)]),
        Section(
            "Figure 27: the state space",
            [Picture(pictures["27"]), Picture(pictures["27 other"]), *_state_space(test, found)],
        ),
    ]
    files = [(path.name, f"figure {name}") for name, path in pictures.items()]
    return PageParts(_lead(found), sections, files=files)


def numbers(test: ThesisTest, found: ThesisFindings) -> dict[str, Any]:
    """Content of ``thesis.json``: the numbers of the page's tables, in SI."""
    return {
        "table_3": [vars(row) | {"stage": vars(row.stage)} for row in found.schedule],
        "minutes": found.minutes,
        "table_4": {"thesis_kg": WEIGHTS, "ours_kg": found.weights},
        "table_5": {"thesis_hz": FREQUENCIES.T, "ours_hz": found.modes.frequency},
        "table_6": {"thesis": DAMPING.T, "ours": found.modes.damping},
        "row_of_thesis": found.partner,
        "mac_with_a": found.modes.mac,
        "error_against_bench": {"frequency": found.worst[0], "damping": found.worst[1]},
        "figure_19": [vars(c) for c in found.cords],
        "figure_23": {"lines_between_half_power_points": found.lines},
        "figure_24": [{"ratio": h.ratio, "p": h.p, "rms_decades": h.rms} for h in found.levels],
        "figure_25_db": found.between_articles,
        "figure_26_db": found.between_excitations,
        "bands_hz": BANDS,
        "figure_27": {"Q": found.state_space.Q, "states": found.states},
        "doubles_hz": [one.doubles for one in found.identified],
        "cords_hz": [one.cords for one in found.identified],
        "level_n": [r.test.level for r in (test.stepped[0], *test.levels, test.bursts[0])],
    }


_TESTED = [
    "The drawing of the thesis' tailgate is not public. Ours is the open tailgate of this "
    "package with formed thickness and a hem that holds. Its first fourteen modes have the mean "
    "damping of table 6, by rank. The rest follows the thesis. Three articles scatter as in "
    "tables 4 to 6. Two cords hold the upper bolt holes and resonate near 23 and 24.5 Hz. A "
    "shaker with its stinger drives the planner's best place (the thesis' best and second best "
    "rattled). There are 30 accelerometers of 5 g at the planner's places and one next to the "
    "shaker. Schedules, spreads and readings from figures can therefore agree, but frequencies "
    "cannot.",
    "Frequencies and figures are measured: recorded on the bench, identified from 10 to 195 Hz "
    "without 23 to 27.5 Hz, as in section 5.1.",
]


def _lead(found: ThesisFindings) -> str:
    m = found.modes.frequency
    return (
        f"{len(m)} modes of tailgate A from {hertz(m[0, 0])} to {hertz(m[-1, 0])} Hz (the "
        f"thesis: 14, 28.2 to 191.6), up to {number(100 * dispersion(m), 2)} % apart between "
        f"three articles (2.3); damping {number(np.nanmin(found.modes.damping), 2)} to "
        f"{number(np.nanmax(found.modes.damping), 2)} (0.0037 to 0.0126)"
    )


def _facts(test: ThesisTest, found: ThesisFindings) -> list[tuple[str, str]]:
    force, coil = test.stepped[0].test.level, test.bursts[0].test.level
    return [
        ("Articles", "A, B, C"),
        ("Sensors", str(len(test.stepped[0].frf.outputs))),
        ("Stepped sine", f"{len(test.stepped[0].frf.frequency)} lines, {number(force, 3)} N"),
        ("Burst random", f"{len(test.bursts[0].frf.frequency)} lines, {number(coil, 3)} N"),
        ("Five sweeps take", f"{number(found.minutes, 3)} min on the bench"),
    ]


def _schedule(found: ThesisFindings) -> list[Block]:
    heads = ("range [Hz]", "lines/octave", "delay", "measure", "sweeps", "our lines",
             "our lines/octave", "transient left [%]")  # fmt: skip
    rows = [
        (f"{r.stage.low:g} – {r.stage.high:g}", number(r.stage.per_octave),
         number(r.stage.delay), number(r.stage.measure), "5", str(r.lines),
         number(r.per_octave), number(100 * r.transient, 2))
        for r in found.schedule
    ]  # fmt: skip
    return [
        Table(heads, rows, ("range [Hz]",), "Delay and measure in cycles, as printed and as run."),
        Text(["No difference: the bench runs this table. A lab cannot measure the last column: "
              "the remaining transient of the lines before. It is the median over the lines of "
              "the range, for the worst channel. 20 to 50 Hz holds 264.4 lines at 200 an octave, "
              "so 264 are run. The thesis prints no force; ours falls to 0.7, 0.5 and 0.2 of the "
              "level above 50, 100 and 200 Hz."]),
    ]  # fmt: skip


def _masses(found: ThesisFindings) -> list[Block]:
    rows = [
        (who, *(f"{x:.3f}" for x in w), number(100 * float(np.ptp(w) / w.mean()), 2))
        for who, w in (("thesis", WEIGHTS), ("ours", found.weights))
    ]
    return [
        Table(("", "A [kg]", "B [kg]", "C [kg]", "difference [%]"), rows, ("",)),
        Text(["Another tailgate, so another mass; the difference is drawn with the standard "
              "deviation of the thesis' three."]),
    ]  # fmt: skip


def _rows(found: ThesisFindings, ours: np.ndarray, thesis: np.ndarray, f: Any) -> list[list[str]]:
    """Our modes with the nearest ones of the thesis, and its modes without partner."""
    rows, theirs_of = [], [int(p) for p in found.partner]
    apart = 100 * spread(ours)
    for k, x in enumerate(ours):
        p = int(found.partner[k])
        theirs = [f(v) for v in thesis[:, p]] if p >= 0 else ["–"] * 3
        rows.append([str(p + 1) if p >= 0 else "–", *theirs, *(f(v) for v in x),
                     number(apart[k], 2)])  # fmt: skip
    for p in range(thesis.shape[1]):
        if p not in found.partner:
            at = max((k + 1 for k, q in enumerate(theirs_of) if 0 <= q < p), default=0)
            theirs_of.insert(at, p)
            rows.insert(at, [str(p + 1), *(f(v) for v in thesis[:, p]), "–", "–", "–", "–"])
    return rows


_HEADS = ("mode of the thesis", "A", "B", "C", "our A", "our B", "our C", "our difference [%]")


def _frequencies(found: ThesisFindings) -> list[Block]:
    rows = _rows(found, found.modes.frequency, FREQUENCIES, hertz)
    m, theirs = found.modes.frequency, FREQUENCIES.T
    bands = []
    for low, high, printed in RANGES:
        ours, thesis = (x[(low <= x[:, 0]) & (x[:, 0] < high)] for x in (m, theirs))
        bands.append((f"{low} – {high}", number(printed), number(100 * dispersion(thesis), 2),
                      number(100 * dispersion(ours), 2)))  # fmt: skip
    heads = ("range [Hz]", "printed [%]", "of its own values [%]", "ours [%]")
    off, zeta = found.worst
    return [
        Table(_HEADS, rows, caption="Hz. Partners are nearest in frequency. The thesis publishes "
                                    "no shapes, so one row may contain two different motions."),
        Table(heads, bands, ("range [Hz]",), "Highest difference, (largest - smallest) / mean."),
        Text(["The frequencies belong to another tailgate. Differences are comparable, because "
              "the articles scatter as in the thesis. From 156 to 200 Hz the thesis prints 1.0 "
              "%, while its mode 12 (181.1, 184.1, 181.5 Hz) differs by 1.6 %.",
              f"Against the poles the bench itself has A is {number(100 * off, 2)} % off in "
              f"frequency and {number(100 * zeta, 2)} % in damping at most."]),
    ]  # fmt: skip


def _damping(found: ThesisFindings) -> list[Block]:
    rows = _rows(found, found.modes.damping, DAMPING, lambda z: number(z, 3))
    zeta = found.modes.damping
    return [
        Table(_HEADS, rows, caption="Fraction of critical."),
        Text([f"Our dampings differ by up to {number(100 * dispersion(zeta), 2)} %, the thesis' by "
              f"up to {number(100 * dispersion(DAMPING.T), 2)} %. A mode's own damping is that of "
              "the same rank in table 6, less what close modes exchange where articles differ; "
              "sensors, stinger and cords add to it."]),
    ]  # fmt: skip


def _cords(found: ThesisFindings) -> list[Block]:
    rows: list[Sequence[str]] = [
        ("cords ring when tapped", "around 23, 24.5 Hz",
         "; ".join(", ".join(hertz(f) for f in c.tapped) for c in found.cords) + " Hz"),
        ("two small peaks; |H| over that with held cords", "seen, no figure",
         "; ".join(", ".join(number(x, 3) for x in c.height) for c in found.cords)),
        ("with rubber the peaks are almost gone", "almost indistinguishable",
         "; ".join(", ".join(number(x, 3) for x in c.rubber) for c in found.cords)),
        ("first flexible mode", "around 28 Hz",
         "; ".join(hertz(c.first[0]) for c in found.cords) + " Hz"),
        ("held by hand it does not move", "exactly the same",
         "; ".join(_moved(c.first[1], c.first[0]) for c in found.cords)),
        ("with rubber it does not move", "the same frequency",
         "; ".join(_moved(c.first[2], c.first[0]) for c in found.cords)),
    ]  # fmt: skip
    return [
        Table(READING, rows, READING, "Ours: tailgates A; B; C, sensor nearest to a cord."),
        Text(["The contribution of a cord depends on the places of shaker and sensor, and none "
              "of our sensors is at a hole. The first mode changes by less than half its "
              "bandwidth of 1 %. Rubber changes it most, because ours has damping but no "
              "stiffness."]),
    ]  # fmt: skip


def _moved(new: float, old: float) -> str:
    """A change in per cent with its sign."""
    return f"{100 * (new / old - 1):+.2f} %"


def _circles(found: ThesisFindings) -> list[Block]:
    lines = found.lines.astype(int)
    few, some, many = ((lines <= 4).sum(), ((lines > 4) & (lines < 8)).sum(), (lines >= 8).sum())
    rows = [
        ("modes with 3 or 4 lines in their bandwidth", "7", f"{few} with 4 or less"),
        ("with 5, 6 or 7", "others", str(some)),
        ("with 8", "1", f"{many} with 8 or more"),
        ("least", "3", str(lines.min())),
    ]
    return [
        Table(READING, rows, READING, "Section 5.2, tailgate A."),
        Text(["Mobility, which weights modes of low and high frequency equally. With 200 lines "
              "an octave 2ζ/0.00347 lines are between half-power points: 3.2 at 0.56 % damping, "
              "7.3 at 1.26 %. The thesis therefore counts the whole bandwidth; its mode 4 of "
              "0.37 % has two lines, below the thesis' minimum of three."]),
    ]  # fmt: skip


def _levels(found: ThesisFindings) -> list[Block]:
    rows = [
        (f"A at {name} the level", "no significant differences",
         f"{number(h.ratio, 3)} of the noise, p = {number(h.p, 2)}, {number(h.rms, 2)} decades")
        for name, h in zip(("half", "twice"), found.levels, strict=True)
    ]  # fmt: skip
    return [
        Table(READING, rows, READING, "Squared difference over what noise explains, its p-value, "
              "rms of log10 of the ratio over all lines and channels."),
        Text(["This bench rattles only with `chladni bench --local clearance`. The curves "
              "coincide, as in the thesis after wood and screws had stopped the rattling."]),
    ]  # fmt: skip


def _articles(found: ThesisFindings) -> list[Block]:
    said = ("very low up to about 200 Hz", "very low up to about 200 Hz", "significant",
            "diminishes", "obvious again")  # fmt: skip
    rows = [
        (f"{low:g} – {high:g} Hz", words, f"{number(x, 2)} dB")
        for (low, high), words, x in zip(BANDS, said, found.between_articles, strict=True)
    ]
    return [
        Table(READING, rows, READING, "Rms over channels and lines of 20 log |H| about the mean of "
              "the articles."),
        Text(["Our scatter is equal for all modes, so it need not diminish near 300 Hz, where "
              "the thesis' articles happen to agree; it grows with the modal density."]),
    ]  # fmt: skip


def _excitations(found: ThesisFindings) -> list[Block]:
    of_articles, of_kinds = found.between_articles[:2].mean(), found.between_excitations[:2].mean()
    rows = [
        ("rms difference below 200 Hz", "tiny", f"{number(float(of_kinds), 2)} dB"),
        ("that of the articles", "more significant", f"{number(float(of_articles), 2)} dB"),
        ("at the faintest quarter of the lines", "main differences",
         f"{number(found.faint, 2)} dB"),
        ("at the strongest quarter", "some variation", f"{number(found.strong, 2)} dB"),
    ]  # fmt: skip
    return [
        Table(READING, rows, READING, "Means of A, B and C; half the difference of 20 log |H|."),
        Text(["The order is the same: anti-resonances differ first, and articles differ more. "
              "Our articles are closer than those of the thesis, because this bench does not "
              "change between two tests: time, cables and room noise have no effect."]),
    ]  # fmt: skip


def _state_space(test: ThesisTest, found: ThesisFindings) -> list[Block]:
    first = found.identified[0]
    q = found.state_space
    rows = [
        ("state space over the recording", "extremely accurate",
         f"{number(100 * (10 ** np.sqrt(q.Q) - 1), 2)} % off (rms of log10: "
         f"{number(np.sqrt(q.Q), 2)})"),
        ("order", "40", str(found.states)),
        ("modes kept", "14", str(len(found.modes.rows))),
        ("poles that mirror a mode", "6 (of modes 1, 2, 5, 7, 12, 13)",
         f"{len(first.doubles)} ({', '.join(hertz(f) for f in first.doubles)} Hz)"),
        ("poles A alone shows", "–", ", ".join(hertz(f) for f in found.modes.alone) or "none"),
        ("poles of the cords", "none named",
         f"{len(first.cords)} ({', '.join(hertz(f) for f in first.cords)} Hz)"),
    ]  # fmt: skip
    doubles = "; ".join(
        f"{name}: {len(one.doubles)}" for name, one in zip("ABC", found.identified, strict=True)
    )
    low, high, along = *CORDS, ", ".join(hertz(f) for f in test.along[0])
    return [
        Table(READING, rows, READING, f"{BAND[0]:g} to {BAND[1]:g} Hz without {low:g} to {high:g} "
                                      "Hz; identified by chladni, which chooses the order by "
                                      "evidence."),
        Text([f"Our identification finds modes twice too ({doubles} poles in the three articles). "
              "Here the reason is known. The noise is low, but with table 3 a part of the "
              "transient of one line remains in the next. A linear model of the article cannot "
              "explain this part. With a wait of 200 cycles at every line they disappear (tried: "
              f"nine poles of A, then none). Cords resonate along their axis too, at {along} Hz "
              "in A; tapping across does not show this. Below 15 Hz weak channels are "
              "inaccurate: there the article moves on its cords, and the residual term L/s² is "
              "not enough."]),
    ]  # fmt: skip
