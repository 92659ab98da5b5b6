"""Files whose every line is well formed and which may still be impossible, or no file of theirs.

Sections without material, inertia of no body, sets that refer in a ring. Records of a universal
file of other types, binary data under another head, and cases that declare what is not so.
"""

import random
from collections.abc import Iterator, Sequence

from chladni.case.key import Key
from chladni.case.schema import SCHEMA
from chladni.io.nastran.read.beam_profiles import SHAPES

from .fuzz_input import FuzzInput, Maker
from .mutations import injured_bytes
from .sound_files import Files

_SOUND_SIZES = (".001", ".002", ".005", ".01", ".012", ".02")
_SIZES = (*_SOUND_SIZES, *_SOUND_SIZES, "", "0.", "-.01", "1.+30", "1.-30")
_MOMENTS = ("", "0.", "-1.-9", "1.-12", "1.-9", "2.-9", "5.-9", "1.", "1.+300")
_MODULI = ("", "0.", "-7.+10", "1.", "2.6+10", "7.+10", "2.1+11", "2.6+11", "1.+300")
_RATIOS = ("", "0.", ".3", ".33", ".5", "-.4", "-1.", ".7", "30.")
_FRAME = """\
SOL 103
CEND
SPC = 1
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,.2,0.,0.
GRID,3,,.4,0.,0.
GRID,4,,.4,.2,0.
SPC1,1,123456,1
{}
ENDDATA
"""
_STEEL = "MAT1,1,2.1+11,,.3,7850."


def _some(rng: random.Random, words: Sequence[str], count: int) -> str:
    return ",".join(rng.choice(words) for _ in range(count))


def _frame(kind: str, rng: random.Random, *cards: str) -> FuzzInput:
    bar = "CBEAM" if any(c.startswith("PBEAM") for c in cards) else "CBAR"
    bars = (f"{bar},{k},1,{k},{k + 1},0.,0.,1." for k in (1, 2, 3))
    text = _FRAME.format("\n".join([*cards, *bars]))
    return FuzzInput(kind, {"frame.bdf": text.encode()}, ("modes", "frame.bdf", "--count", "6"))


def _section(rng: random.Random, sound: Files) -> FuzzInput:
    """Bars of a profile, or of moments, that may be none."""
    if rng.random() < 0.25:
        moments = [rng.choice(_MOMENTS) for _ in range(5)]
        cards = [f"PBAR,1,1,1.-4,{','.join(moments[:3])}", ",", f",,,{moments[4]}"]
    else:
        shape = rng.choice(list(SHAPES))
        count = SHAPES[shape][1] + rng.choice((0, 0, 0, 0, -1, 1))
        sizes = _some(rng, rng.choice((_SIZES, _SOUND_SIZES)), count)
        cards = [f"{rng.choice(('PBARL', 'PBEAML'))},1,1,,{shape}", f",{sizes}"]
        if shape in ("BOX", "I", "TUBE") and rng.random() < 0.5:  # not far from a sound one
            wall = f"{rng.choice(('.001', '.005', '.006', '.01'))},.002"
            cards[1] = {"BOX": f",.02,.01,{wall}", "I": f",.03,.02,.01,{wall},.004"}.get(
                shape, f",.01,{rng.choice(_SIZES)}"
            )
    return _frame("section", rng, _STEEL, *cards)


def _inertia(rng: random.Random, sound: Files) -> FuzzInput:
    """Lumps whose inertia, materials whose constants, bricks whose corners may be of none."""
    lump = f"CONM2,9,4,,.3,{_some(rng, _SIZES, 3)}"
    more = f",{rng.choice(_MOMENTS)},{_some(rng, _MOMENTS, 5)}"
    cards = [f"MAT1,1,{_some(rng, _MODULI, 2)},{rng.choice(_RATIOS)},{rng.choice(_MODULI)}"]
    cards = rng.choice(([_STEEL], [_STEEL], cards))
    cards += ["PBAR,1,1,1.-4,1.-9,2.-9,2.-9", lump, more, "PSOLID,9,1"]
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    order = list(range(8))
    if rng.random() < 0.3:
        a, b = sorted(rng.sample(range(9), 2))
        order[a:b] = rng.choice((order[a:b][::-1], order[a + 1 : b] + order[a : a + 1]))
    for k, (x, y, z) in enumerate(corners):
        cards.append(f"GRID,{11 + k},,{0.1 * x:g},{0.1 * y:g},{0.1 * z:g}")
    nodes = [str(11 + k) for k in order]
    cards += [
        f"CHEXA,9,9,{','.join(nodes[:6])}",
        f",{','.join(nodes[6:])}",
        "SPC1,1,123,11,THRU,14",
    ]
    return _frame("inertia", rng, *cards)


def _sets(rng: random.Random, sound: Files) -> FuzzInput:
    """Sets of supports and ties that add each other, in rings and to nothing as well."""
    ids = range(2, 8)
    cards = [_STEEL, "PBAR,1,1,1.-4,1.-9,2.-9,2.-9", "SPC1,2,123456,1", "MPC,3,3,1,1.,4,1,-1."]
    for word in ("SPCADD", "MPCADD"):
        for set_ in rng.sample(ids, rng.randint(1, 4)):
            members = [rng.choice((*ids, set_)) for _ in range(rng.randint(1, 3))]
            cards.append(f"{word},{set_},{','.join(map(str, members))}")
    made = _frame("sets", rng, *cards)
    call = rng.choice((*map(str, ids), "9", "ALL", "NONE", "0", "-2"))
    text = made.files["frame.bdf"].decode().replace("SPC = 1", f"SPC = {call}")
    tied = rng.choice(("", f"MPC = {rng.choice((*map(str, ids), 'ALL'))}\n"))
    text = text.replace("BEGIN BULK", f"{tied}BEGIN BULK")
    return FuzzInput("sets", {"frame.bdf": text.encode()}, made.arguments)


def _number(line: str, at: int, width: int, value: object) -> str:
    return line[:at].ljust(at) + f"{value:>{width}}" + line[at + width :]


def _function(rng: random.Random, sound: Files) -> FuzzInput:
    """Records of a universal file of other types: of function, of numbers, of axes, of places."""
    lines = sound["frf.uff"].decode().split("\n")
    heads = [k + 6 for k, line in enumerate(lines) if line.strip() == "58"]
    fields = (
        *(
            (0, 0, 5, (*range(28), 99, -1)),
            (0, 41, 10, (0, 1, 2, 7, 999)),
            (0, 51, 4, range(-6, 7)),
        ),
        *((0, 66, 10, (0, 1, 7)), (0, 76, 4, range(-6, 7)), (1, 0, 10, range(9))),
        *((1, 10, 10, (0, 1, 160, 162, 999)), (1, 20, 10, (0, 1, 2))),
        *((k, 0, 10, (*range(21), 99)) for k in (2, 3, 4)),
        *((k, 10, 5, range(-4, 5)) for k in (2, 3, 4)),
    )
    for _ in range(rng.randint(1, 3)):
        row, at, width, values = rng.choice(fields)
        for head in rng.sample(heads, rng.choice((1, 1, len(heads)))):
            lines[head + row] = _number(lines[head + row], at, width, rng.choice(list(values)))
    command = rng.choice(("identify", "test"))
    return FuzzInput("function", {"frf.uff": "\n".join(lines).encode()}, (command, "frf.uff"))


def _binary(rng: random.Random, sound: Files) -> FuzzInput:
    """Binary records: a first line that does not fit them, or bytes that are not theirs."""
    data = sound["frf.ufb"]
    if rng.random() < 0.5:
        data = injured_bytes(data, rng)
    else:
        at = rng.choice([k for k in range(len(data)) if data.startswith(b"    58b", k)])
        column, width = rng.choice(((7, 6), (13, 6), (19, 12), (31, 12), (43, 6), (49, 6)))
        value = rng.choice((b"", b"0", b"1", b"2", b"3", b"11", b"-8", b"1288", b"2576", b"x"))
        at += column
        data = data[:at] + value.rjust(width) + data[at + width :]
    return FuzzInput("binary", {"frf.ufb": data}, (rng.choice(("identify", "test")), "frf.ufb"))


_STATED = ("-1.0", "0.0", "1e-9", "0.001", "0.5", "1.0", "2.2", "9.80665", "1000.0", "1e9", "inf",
           "nan", "true", "[]")  # fmt: skip


def _value(rng: random.Random, key: Key) -> str:
    """A value of a word of the case: one of its choices, its example, or a number."""
    if key.choices and rng.random() < 0.8:
        return f'"{rng.choice(key.choices)}"'
    return key.example if rng.random() < 0.3 else rng.choice(_STATED)


def _stated(rng: random.Random) -> Iterator[tuple[Key, str]]:
    sections = ("model", "test", "[recording]", "band", "held_out", "[parameter]")
    keys = [k for k in SCHEMA if k.section.strip("[]") in {s.strip("[]") for s in sections}]
    for key in rng.sample(keys, rng.randint(1, 3)):
        yield key, _value(rng, key)


def _quantity(rng: random.Random, sound: Files) -> FuzzInput:
    """A case that declares what its recording, its sensors or its article are not."""
    files = {n: sound[n] for n in ("case.toml", "plate.bdf", "frf.npz", "frf.uff", "sensors.csv")}
    lines = files["case.toml"].decode().split("\n")
    for key, value in _stated(rng):
        named = {f"[{key.section}]", f"[[{key.section}]]", key.section}
        heads = [k for k, line in enumerate(lines) if line in named]
        for head in heads[:1]:
            end = lines.index("", head)
            lines[head:end] = [
                *(s for s in lines[head:end] if s.partition(" =")[0] != key.name),
                f"{key.name} = {value}",
            ]
    files["case.toml"] = "\n".join(lines).encode()
    if rng.random() < 0.4:
        files["sensors.csv"] = _other_sensors(files["sensors.csv"].decode(), rng).encode()
    command = rng.choice(("check", "check", "correlate", "identify", "test"))
    return FuzzInput("quantity", files, (command, "."))


def _other_sensors(text: str, rng: random.Random) -> str:
    """The table of sensors with its grids in another order, or other masses, directions, gains."""
    head, *rows = text.strip().split("\n")
    cells = [row.split(",") for row in rows]
    column = rng.choice((1, 5, 6, 7, 8))
    words = [c[column] for c in cells]
    if column == 1:
        rng.shuffle(words)
    else:
        others = {5: ("-Z", "+X", "n", "+Y"), 6: ("input", "output"), 7: ("5", ".0005", "-1", "0")}
        words = [rng.choice(others.get(column, ("1", "0", "-1", ".02"))) for _ in words]
    for c, word in zip(cells, words, strict=True):
        c[column] = word
    return "\n".join([head, *(",".join(c) for c in cells), ""])


CONTRADICTIONS: dict[str, Maker] = {
    "section": _section,
    "inertia": _inertia,
    "sets": _sets,
    "function": _function,
    "binary": _binary,
    "quantity": _quantity,
}
