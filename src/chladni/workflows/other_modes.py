"""Compare normal modes of a model with another program's, from OP2, punch or universal files."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import checked
from ..dofs import parse
from ..dynamics.modes import rigid_modes
from ..ema.correlation import mac, subspace_mac
from ..ema.mode_pairing import ModePairs, pair
from ..errors import FileError, LabelError
from ..io.nastran import read_op2_modes, read_punch_modes
from ..io.nastran.results.punch import PunchModes
from ..io.uff.read_uff import read_uff
from ..model.assembly import Assembly
from ..parallel import one_blas_thread
from ..progress import Progress, silent
from ..results import Result
from ..units import Units
from .loaded_model import Model, as_model, similar_names

if TYPE_CHECKING:
    from .given_case import Source

RIGID = 0.03  # of the model's first elastic frequency: modes below are rigid motions, in both
CLOSE = 0.01  # relative distance of frequencies within which shapes may mix
MORE = 1.5  # modes that are solved for every one of the file, so that all of them find theirs
LEAST_GRIDS = 3  # grids in common: on fewer all shapes look similar
READERS = (".op2", ".pch", ".punch", ".unv", ".uff", ".uf")


@dataclass(frozen=True, eq=False, repr=False)
class OtherModes(Result):
    """Elastic modes of the model and of a file, each numbered from 1 as in its source.

    Attributes
    ----------
    source : Path
    f_other, f_model : (r_other,), (r_model,) [Hz]
    numbers_other, numbers_model : mode numbers, rigid ones counted
    mac : (r_model, r_other)
    pairs : ModePairs
    in_span : (r_other,)      share of each shape of the file in the span of the model's modes
                              within 1 % of its frequency: the MAC if modes could not mix
    grids, translations : how many were compared
    shapes : (n_points, 3, r_other)   motion of the file's modes, basic frame; 0 where it has none
    whole : the file moves every grid that shells, solids or beams hang on
    """

    source: Path
    f_other: np.ndarray
    f_model: np.ndarray
    numbers_other: tuple[int, ...]
    numbers_model: tuple[int, ...]
    mac: np.ndarray
    pairs: ModePairs
    in_span: np.ndarray
    grids: int
    translations: int
    shapes: np.ndarray
    whole: bool
    notes: tuple[str, ...] = ()


def read_modes(path: Path) -> PunchModes:
    """Read normal modes of an OP2, punch or universal file, components 1-6 of every point.

    Raises
    ------
    FileError
        If it is another kind of file, or holds no shapes.
    """
    if not path.is_file():
        raise FileError(f"no file {path}{similar_names(path)}")
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise FileError(f"{path}: modes are read from {', '.join(READERS)}, not {suffix or '?'}")
    if suffix == ".op2":
        return read_op2_modes(path)
    return read_punch_modes(path) if suffix in (".pch", ".punch") else _universal(path)


def _universal(path: Path) -> PunchModes:
    """Read dataset 55 of a universal file."""
    shapes = read_uff(path).shapes
    if shapes is None:
        raise FileError(f"{path} has no mode shapes (dataset 55)")
    try:
        dofs = [parse(label) for label in shapes.dofs]
    except LabelError as error:
        raise FileError(f"{path}: {error}") from error
    ids, row = np.unique([point for point, *_ in dofs], return_inverse=True)
    values = np.full((len(ids), 6, shapes.values.shape[1]), np.nan)
    for k, (_, component, sign), value in zip(row, dofs, shapes.values, strict=True):
        values[k, component - 1] = sign * np.real(value)
    return PunchModes(np.asarray(shapes.frequency), ids, values)


@checked
@one_blas_thread()
def other_modes(
    source: "Source",
    path: Path | str,
    *,
    units: str | Units | None = None,
    progress: Progress = silent,
) -> OtherModes:
    """Pair the modes of a file with the model's, by frequency and by shape at common grids.

    Parameters
    ----------
    source : a model, a case, an Assembly, or the path of a deck or case
    path : OP2, punch or universal file (dataset 55)
    units : of a deck given by its path

    Raises
    ------
    FileError
        If the file holds no elastic modes, or hardly a grid of the model.
    """
    model, path = as_model(source, "correlate", units), Path(path)
    progress("reading the modes", 0.0)
    read = read_modes(path)
    rows, values = _on_model(model.assembly, read, path)
    progress("modes of the model", 0.2)
    modal = model.normal_modes(int(MORE * len(read.frequency)) + 6)
    flexible = modal.frequency[~rigid_modes(modal)]
    least = RIGID * float(flexible.min(initial=np.inf))
    elastic = read.frequency > least
    if not elastic.any():
        raise FileError(f"{path}: none of its {len(read.frequency)} modes is elastic")
    top = float(read.frequency.max())
    near = (modal.frequency > least) & (modal.frequency <= 1.3 * top)
    own = model.motion(modal.shapes[:, near])[rows]
    held = np.isfinite(values[:, :, elastic]).all(axis=2)
    if held.sum() < LEAST_GRIDS:
        raise FileError(f"{path} has {held.sum()} translations of the model; shapes need more")
    phi, psi = own[held], values[:, :, elastic][held]
    f_model, f_other = modal.frequency[near], read.frequency[elastic]
    M = mac(phi, psi)
    shapes = np.zeros((len(model.assembly.points), 3, int(elastic.sum())))
    shapes[rows] = np.nan_to_num(values[:, :, elastic])
    return OtherModes(
        path, f_other, f_model,
        tuple((np.flatnonzero(elastic) + 1).tolist()), tuple((np.flatnonzero(near) + 1).tolist()),
        M, pair(f_model, f_other, M), _in_span(phi, psi, f_model, f_other),
        len(rows), int(held.sum()), shapes, _whole(model.assembly, rows),
        (*model.notes, *_notes(model, read, rows, elastic)), origin=model,
    )  # fmt: skip


def _on_model(made: Assembly, read: PunchModes, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return rows of the model's points in the file, and translations there (basic frame)."""
    known = np.isin(read.ids, made.ids)
    if known.sum() < LEAST_GRIDS:
        raise FileError(
            f"{path} has {known.sum()} grids of the model (its {len(read.ids)} run from "
            f"{read.ids.min()} to {read.ids.max()}, the deck's from {made.ids[0]} to "
            f"{made.ids[-1]}): check that it belongs to this deck"
        )
    rows, values = made.rows(read.ids[known]), read.shapes[known, :3]
    if made.axes is None:
        return rows, values
    return rows, np.einsum("nij,nir->njr", made.axes[rows], values)


def _in_span(
    phi: np.ndarray, psi: np.ndarray, f_model: np.ndarray, f_other: np.ndarray
) -> np.ndarray:
    out = np.zeros(len(f_other))
    for k, f in enumerate(f_other):
        close = np.abs(f_model / f - 1) < CLOSE
        if close.any():
            out[k] = subspace_mac(psi[:, k : k + 1], phi[:, close])[0]
    return out


def _whole(made: Assembly, rows: np.ndarray) -> bool:
    seen = [made.shells.nodes, made.beams.nodes, *(s.nodes for s in made.solids)]
    drawn = np.unique(np.concatenate([nodes.ravel() for nodes in seen]))
    return bool(np.isin(drawn, rows).all())


def _notes(model: Model, read: PunchModes, rows: np.ndarray, elastic: np.ndarray) -> list[str]:
    out = [f"Shapes are compared at the translations of {len(rows)} grids."]
    if left := len(read.ids) - len(rows):
        out.append(f"{left} points of the file are not in the deck and were left out.")
    if rigid := int((~elastic).sum()):
        out.append(f"{rigid} modes of the file are rigid motions and are not compared.")
    if not model.unit:
        out.append("Frequencies are in Hz in any unit system with seconds.")
    return out
