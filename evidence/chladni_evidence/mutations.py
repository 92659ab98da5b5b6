"""Injuries to files, as users have them: cut, doubled, misspelt, of the wrong kind, damaged."""

import io
import random
import zipfile
from collections.abc import Callable

import numpy as np

WORDS = (
    "", "0", "-1", "3.7", "1e400", "-1e-320", "1.+308", "nan", "inf", "-inf", "99999999",
    "7777777777777777", "9" * 400, "1.5-3", "THRU", "ABC", "123456", "1e5", "' OR", '"', "[]",
    "x" * 300, "²:+Z", "\x1b[31m", "\x00", "0x10", "1,2", "${HOME}", "../../etc/passwd", "=", "*",
)  # fmt: skip


def injured_text(data: bytes, rng: random.Random) -> bytes:
    """A text with one to three injuries to its lines."""
    for _ in range(rng.randint(1, 3)):
        lines = data.splitlines(keepends=True) or [b"\n"]
        kind = rng.choice(_TEXT)
        data = b"".join(kind(lines, rng.randrange(len(lines)), rng))
    return data


Lines = list[bytes]


def _cut(lines: Lines, k: int, rng: random.Random) -> Lines:
    return lines[:k] + lines[k + rng.choice((1, 1, 2, 9)) :]


def _doubled(lines: Lines, k: int, rng: random.Random) -> Lines:
    at = rng.choice((k, rng.randrange(len(lines))))
    return [*lines[:at], lines[k], *lines[at:]]


def _swapped(lines: Lines, k: int, rng: random.Random) -> Lines:
    j = rng.randrange(len(lines))
    lines[k], lines[j] = lines[j], lines[k]
    return lines


def _truncated(lines: Lines, k: int, rng: random.Random) -> Lines:
    return [*lines[:k], lines[k][: rng.randrange(len(lines[k]) + 1)]]


def _byte(lines: Lines, k: int, rng: random.Random) -> Lines:
    line = lines[k]
    at = rng.randrange(len(line))
    return [*lines[:k], line[:at] + bytes([rng.randrange(256)]) + line[at + 1 :], *lines[k + 1 :]]


def _letter(lines: Lines, k: int, rng: random.Random) -> Lines:
    """Misspell a word."""
    line = lines[k]
    at = rng.randrange(len(line))
    return [*lines[:k], line[:at] + line[at : at + 1] + line[at:], *lines[k + 1 :]]


def _field(lines: Lines, k: int, rng: random.Random) -> Lines:
    """Replace a field of eight columns by another word."""
    line, at = lines[k], 8 * rng.randrange(1, 10)
    word = rng.choice(WORDS).encode()[:8].rjust(8)
    return [*lines[:k], line[:at].ljust(at) + word + line[at + 8 :], *lines[k + 1 :]]


def _token(lines: Lines, k: int, rng: random.Random) -> Lines:
    """Replace a word between commas or blanks."""
    line = lines[k]
    mark = b"," if b"," in line else b" "
    tokens = line.rstrip(b"\r\n").split(mark)
    tokens[rng.randrange(len(tokens))] = rng.choice(WORDS).encode()
    return [*lines[:k], mark.join(tokens) + b"\n", *lines[k + 1 :]]


def _negated(lines: Lines, k: int, rng: random.Random) -> Lines:
    """Change the sign or size of a number."""
    line = lines[k]
    digits = [i for i in range(len(line)) if line[i : i + 1].isdigit()]
    if not digits:
        return lines
    at = rng.choice(digits)
    new = rng.choice((b"-", b".", b"e", b"9", b"0", b""))
    return [*lines[:k], line[:at] + new + line[at + 1 :], *lines[k + 1 :]]


_TEXT = (_cut, _doubled, _swapped, _truncated, _byte, _letter, _field, _token, _token, _negated)


def injured_bytes(data: bytes, rng: random.Random) -> bytes:
    """Bytes of other values, half of the time cut off behind some, or with some more within."""
    raw = bytearray(data)
    for _ in range(rng.choice((0, 1, 5, 20))):
        raw[rng.randrange(len(raw))] = rng.randrange(256)
    at = rng.randrange(len(raw))
    cut, longer = raw[:at], raw[:at] + rng.randbytes(rng.choice((1, 8))) + raw[at:]
    return bytes(rng.choice((raw, raw, cut, longer)))


def injured_archive(data: bytes, rng: random.Random) -> bytes:
    """An NPZ with one array of another kind, or its bytes damaged."""
    if rng.random() < 0.2:
        return injured_bytes(data, rng)
    with np.load(io.BytesIO(data), allow_pickle=False) as held:
        arrays = {name: held[name] for name in held.files}
    name = rng.choice(list(arrays))
    arrays[name] = rng.choice(_ARRAY)(arrays[name], rng)
    if rng.random() < 0.15:
        arrays[f"{name}{rng.choice(('', '2', ' '))}x"] = arrays.pop(name)
    return packed({k: v for k, v in arrays.items() if v is not None})


def packed(arrays: dict[str, np.ndarray]) -> bytes:
    """Bytes of an NPZ, also with arrays of objects, which a reader must not unpickle."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, value in arrays.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asanyarray(value))
    return out.getvalue()


Injury = Callable[[np.ndarray, random.Random], np.ndarray | None]


def _spoilt(a: np.ndarray, rng: random.Random) -> np.ndarray:
    if a.dtype.kind not in "fc" or not a.size:
        return a.astype(object)
    a = a.copy()
    bad = rng.choice((np.nan, np.inf, -1.0, 0.0, 1e300, 1e-320))
    a.flat[rng.randrange(a.size)] = bad
    return a


_ARRAY: tuple[Injury, ...] = (
    _spoilt, _spoilt, _spoilt,
    lambda a, rng: None,
    lambda a, rng: np.atleast_1d(a)[..., :0],
    lambda a, rng: np.concatenate([a.ravel(), a.ravel()[:1]]),
    lambda a, rng: a.ravel()[: a.size // 2],
    lambda a, rng: np.broadcast_to(a.ravel()[0], a.shape),
    lambda a, rng: a.ravel()[::-1].reshape(a.shape),
    lambda a, rng: a.astype(f"U{rng.choice((1, 40))}"),
    lambda a, rng: a.astype(object),
    lambda a, rng: np.zeros(a.shape, rng.choice(("M8[s]", "V8", "i1", "f2", "?", "m8[s]"))),
    lambda a, rng: np.zeros(a.shape, [("a", "<f8"), ("b", "<i8")]),
    lambda a, rng: np.asarray(rng.choice(WORDS)),
    lambda a, rng: a[None],
    lambda a, rng: -np.ones(a.shape),
)  # fmt: skip
