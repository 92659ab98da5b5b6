"""Compare normal modes of a model with those of another deck or of another program's file."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import checked
from ..case.sensor_places import placed
from ..dofs import parse
from ..dynamics.modes import rigid_modes
from ..ema.correlation import mac, subspace_mac
from ..ema.mode_pairing import ModePairs, pair
from ..ema.setup import Recording, Sensor
from ..ema.shapes import mixture, turned
from ..errors import FileError, LabelError
from ..fem.measured_dofs import MeasuredDofs
from ..geometry.sampling import farthest_point_sample
from ..io.mesh_format import foreign_format
from ..io.nastran import read_op2_modes, read_punch_modes
from ..io.nastran.results.punch import PunchModes
from ..io.uff.read_uff import read_uff
from ..model.assembly import Assembly
from ..parallel import one_blas_thread
from ..progress import Progress, silent
from ..results import Result
from ..units import Units
from .loaded_model import LEAST_MODES, Model, as_model, is_case, similar_names
from .matched_dofs import matched_nodes

if TYPE_CHECKING:
    from .given_case import Source

RIGID = 0.03  # of the model's first elastic frequency: modes below are rigid motions, in both
CLOSE = 0.01  # relative distance of frequencies within which shapes may mix
MORE = 1.5  # modes that are solved for every one of the file, so that all of them find theirs
LEAST_GRIDS = 3  # grids in common: on fewer all shapes look similar
READERS = (".op2", ".pch", ".punch", ".unv", ".uff", ".uf")
DECKS = (".bdf", ".dat", ".nas", ".fem", ".blk", ".ecd")
ELASTIC = 20  # modes of another deck that are compared
SPREAD = 200  # points of another mesh that are compared


@dataclass(frozen=True, eq=False, repr=False)
class OtherModes(Result):
    """Elastic modes of the model and of a file or deck, each numbered from 1 as in its source.

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
    shapes : (n_points, 3, r_other)   motion of the file's modes, basic frame; of complex modes the
                              real part, turned to be as large as it can be
    motion : (n_points, 3, r_model)   of the model's modes
    expanded : number of grids of elements that the file lacks; they move in ``shapes`` as the
               mixture of the model's modes that fits the others best (SEREP)
    whole : ``shapes`` move every grid that shells, solids or beams hang on; else these are 0
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
    motion: np.ndarray
    expanded: int
    whole: bool
    notes: tuple[str, ...] = ()


def read_modes(path: Path, units: str | Units | None = None) -> tuple[PunchModes, Recording | None]:
    """Read normal modes of an OP2, punch or universal file, or compute those of a deck.

    They have components 1-6 of every point.

    Returns
    -------
    Modes, and a recording with the places and axes of the nodes of a universal file or deck.
    """
    if not path.exists():
        raise FileError(f"no file {path}{similar_names(path)}")
    suffix = path.suffix.lower()
    if is_case(path) or suffix in DECKS or (suffix not in READERS and foreign_format(path)):
        return _of_model(as_model(path, "correlate", None if is_case(path) else units))
    if suffix not in READERS:
        raise FileError(
            f"{path}: modes are read from {', '.join(READERS)}, or computed of a deck "
            f"({', '.join(DECKS)}), not {suffix or '?'}"
        )
    if suffix == ".op2":
        return read_op2_modes(path), None
    return (read_punch_modes(path), None) if suffix in (".pch", ".punch") else _universal(path)


def _universal(path: Path) -> tuple[PunchModes, Recording]:
    """Read dataset 55 of a universal file; a component that is zero in all modes is not measured.

    Test systems fill in zeros for the directions that they did not measure.
    """
    recording = read_uff(path)
    shapes = recording.shapes
    if shapes is None:
        raise FileError(f"{path} has no mode shapes (dataset 55)")
    try:
        dofs = [parse(label) for label in shapes.dofs]
    except LabelError as error:
        raise FileError(f"{path}: {error}") from error
    ids, row = np.unique([point for point, *_ in dofs], return_inverse=True)
    values = np.full((len(ids), 6, shapes.values.shape[1]), np.nan, shapes.values.dtype)
    for k, (_, component, sign), value in zip(row, dofs, shapes.values, strict=True):
        if value.any():
            values[k, component - 1] = sign * value
    return PunchModes(np.asarray(shapes.frequency), ids, values), recording


def _of_model(other: Model) -> tuple[PunchModes, Recording]:
    """Elastic modes of another deck in the basic frame, at grids that something moves or holds."""
    made = other.assembly
    modal = other.normal_modes(ELASTIC + LEAST_MODES)
    u = other.motion(modal.shapes)
    used = np.asarray(u.any(axis=(1, 2)))
    used[made.supports[:, 0]] = True
    values = np.full((used.sum(), 6, u.shape[2]), np.nan)
    values[:, :3] = u[used]
    ids = made.ids[used]
    places = dict(zip(ids.tolist(), made.points[used], strict=True))
    return PunchModes(modal.frequency, ids, values), Recording(other.source.name, nodes=places)


@checked
@one_blas_thread()
def other_modes(
    source: "Source",
    path: "Source",
    *,
    units: str | Units | None = None,
    progress: Progress = silent,
) -> OtherModes:
    """Pair the modes of a file or deck with the model's, by frequency and shape at common grids.

    Parameters
    ----------
    source : a model, a case, an Assembly, or the path of a deck or case
    path : OP2, punch or universal file (dataset 55), or another deck as ``source``, whose mesh
        need not be the same: one with a joint left out, or softened, or modelled in another way
    units : of decks given by their paths

    Raises
    ------
    FileError
        If the file holds no elastic modes, or hardly a grid of the model.
    """
    model = as_model(source, "correlate", units)
    progress("reading the modes", 0.0)
    if isinstance(path, str | Path):
        path = Path(path)
        read, recording = read_modes(path, units or model.units)
    else:
        other = as_model(path, "correlate", units)
        path, (read, recording) = other.source, _of_model(other)
    at = _on_model(model, read, recording, path)
    progress("modes of the model", 0.2)
    modal = model.normal_modes(int(MORE * len(read.frequency)) + 6)
    flexible = modal.frequency[~rigid_modes(modal)]
    least = RIGID * float(flexible.min(initial=np.inf))
    elastic = read.frequency > least
    if not elastic.any():
        raise FileError(f"{path}: none of its {len(read.frequency)} modes is elastic")
    top = float(read.frequency.max())
    near = (modal.frequency > least) & (modal.frequency <= 1.3 * top)
    values = at.values[:, :, elastic]
    held = np.isfinite(values).all(axis=2)
    if held.sum() < LEAST_GRIDS:
        raise FileError(f"{path} has {held.sum()} translations of the model; shapes need more")
    phi, psi = at.own(model, modal.shapes[:, near])[held], values[held]
    f_model, f_other = modal.frequency[near], read.frequency[elastic]
    M = mac(phi, psi)
    made = model.assembly
    whole = model.motion(modal.shapes[:, near])
    shapes, lacks = _on_all_grids(made, at, values, whole, phi)
    in_span = np.zeros(len(f_other))
    for k, f in enumerate(f_other):
        close = np.abs(f_model / f - 1) < CLOSE
        if close.any():
            in_span[k] = subspace_mac(psi[:, k : k + 1], phi[:, close])[0]
    return OtherModes(
        path, f_other, f_model,
        tuple((np.flatnonzero(elastic) + 1).tolist()), tuple((np.flatnonzero(near) + 1).tolist()),
        M, pair(f_model, f_other, M), in_span,
        len(at.values), int(held.sum()), shapes, whole, max(lacks, 0), lacks >= 0,
        (*model.notes, *_notes(path.name, model, read, at, elastic)), origin=model,
    )  # fmt: skip


def _on_all_grids(
    made: Assembly, at: "_Points", values: np.ndarray, whole: np.ndarray, phi: np.ndarray
) -> tuple[np.ndarray, int]:
    """Shapes of a file with grids of elements that it lacks, and their number.

    The number is negative where the points in common cannot tell the model's modes apart.
    """
    seen = [made.shells.nodes, made.beams.nodes, *(s.nodes for s in made.solids)]
    drawn = np.unique(np.concatenate([nodes.ravel() for nodes in seen]))
    rows, real = np.setdiff1d(drawn, at.row), _real(values)
    out = at.drawn(made, real)
    if not len(rows):
        return out, 0
    q = mixture(phi, real[np.isfinite(values).all(axis=2)])
    if q is None:
        return out, -len(rows)
    out[rows] = whole[rows] @ q
    return out, len(rows)


def _real(values: np.ndarray) -> np.ndarray:
    """Shapes (n, 3, r) as real as they can be turned; 0 where there is no value."""
    psi = np.nan_to_num(values)
    if np.iscomplexobj(psi):
        psi = turned(psi.reshape(-1, psi.shape[2]).T).T.real.reshape(psi.shape)
    return psi


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of a file that the model has."""

    row: np.ndarray  # (n,) int; grid of the model, -1 for a place away from grids
    free: MeasuredDofs  # directions X, Y, Z of the places away from grids, in this order
    axes: np.ndarray  # (n, 3, 3) local axes of the file by row, basic frame
    values: np.ndarray  # (n, 3, r) translations of the file along them, nan where it has none
    said: tuple[str, ...]  # notes on how they were matched

    def own(self, model: Model, shapes: np.ndarray) -> np.ndarray:
        """Translations of the model's modes (n_free_dofs, k) along the file's axes (n, 3, k)."""
        u = model.motion(shapes)[self.row]
        if len(self.free.labels):
            moved = self.free.rows(model.structure) @ shapes
            u[self.row < 0] = moved.reshape(-1, 3, shapes.shape[1])
        return np.asarray(np.einsum("nij,njr->nir", self.axes, u))

    def drawn(self, made: Assembly, psi: np.ndarray) -> np.ndarray:
        """Real shapes of the file (n_points, 3, r), basic frame, 0 where it has no point."""
        out, at = np.zeros((len(made.points), 3, psi.shape[2])), self.row >= 0
        out[self.row[at]] = np.einsum("nij,nir->njr", self.axes[at], psi[at])
        return out


def _on_model(model: Model, read: PunchModes, recording: Recording | None, path: Path) -> _Points:
    """Find the points of the file on the model: grids by number or place, else the place itself."""
    made = model.assembly
    found = matched_nodes(made, recording or Recording(path.name), read.ids)
    sensors, missing = [], found.row < 0
    rest = np.flatnonzero(missing & np.isfinite(found.place).all(axis=1))
    if path.suffix.lower() not in READERS:  # the grids of another deck are many
        few = SPREAD if 2 * len(rest) > len(missing) else 0
        rest = np.sort(rest[farthest_point_sample(found.place[rest], few)])
    for k in rest:
        three = [Sensor(f"{read.ids[k]}:+{c}", None, found.place[k], w) for c, w in _AXES]
        try:
            placed(made, three, path.name)
        except LabelError:  # far from the structure
            continue
        sensors += three
        missing[k] = False
    kept = np.flatnonzero(~missing)
    if len(kept) < LEAST_GRIDS:
        raise FileError(
            f"{path} has {len(kept)} grids of the model (its {len(read.ids)} run from "
            f"{read.ids.min()} to {read.ids.max()}, the deck's from {made.ids[0]} to "
            f"{made.ids[-1]}), and no places on it: check that it belongs to this deck"
        )
    said = [f"Places of {path.name} were read in {found.unit}."] * (found.unit != "m")
    if found.by_place:
        said.append(f"Points found at grids of other numbers, by place: {found.by_place}.")
    if sensors:
        said.append(f"Points taken on the mesh, away from grids: {len(sensors) // 3}.")
    row = found.row[kept]
    axes = np.array([_axes(made, recording, int(n), int(k))
                     for n, k in zip(read.ids[kept], row, strict=True)])  # fmt: skip
    free = placed(made, sensors, path.name)
    return _Points(row, free, axes, read.shapes[kept, :3], tuple(said))


_AXES = tuple(zip("XYZ", np.eye(3), strict=True))


def _axes(made: Assembly, recording: Recording | None, node: int, row: int) -> np.ndarray:
    """Local axes of a point: the file's where it knows the point, else those of the grid."""
    if recording is not None and node in recording.nodes:
        return np.asarray(recording.axes.get(node, np.eye(3)))
    return np.eye(3) if made.axes is None else made.axes[row]


def _notes(
    name: str, model: Model, read: PunchModes, at: _Points, elastic: np.ndarray
) -> list[str]:
    where = "grids" if (at.row >= 0).all() else "points"
    out = [f"Shapes are compared at the translations of {len(at.row)} {where}.", *at.said]
    if left := len(read.ids) - len(at.row):
        out.append(f"{left} points of {name} are not in the deck, or not used, and were left out.")
    if rigid := int((~elastic).sum()):
        out.append(f"{rigid} modes of {name} are rigid motions and are not compared.")
    if np.iscomplexobj(at.values):
        out.append(f"The shapes of {name} are complex: the MAC is that of complex shapes.")
    if not model.unit:
        out.append("Frequencies are in Hz in any unit system with seconds.")
    return out
