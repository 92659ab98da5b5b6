"""Article, accelerometers, cords, stinger, gauge and shaker as one system, by its poles."""

from dataclasses import dataclass, field, replace

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.errors import ModelError

from .accelerometers import AccelerometerType, shown
from .bench_article import BenchArticle
from .cords import INNER, Cord, cord_matrices, cords_for
from .front_end import FrontEnd
from .pole_model import PoleModel, by_poles
from .room import SOURCES, room_density, room_loads
from .shaker import ForceGauge, Shaker

SWINGING = 0.7  # rigid motions as gravity holds them [Hz], about √(g / 0.5 m) / 2π
RIGID_DAMPING = 0.03
NARROW = 0.04  # relative distance between the swinging frequencies: no pole is there twice


@dataclass(frozen=True)
class BenchSetup:
    """Equipment of a test.

    With ``cords`` None there is one cord per hanger, tuned as in the thesis, with or without rubber
    at its end. With ``shaker`` None a hammer excites the article. ``room`` is the motion of the
    median accelerometer from sound and floor alone, rms over the band of the test [m/s²].
    """

    accelerometer: AccelerometerType = field(default_factory=AccelerometerType)
    shaker: Shaker | None = field(default_factory=Shaker)
    cords: tuple[Cord, ...] | None = None
    rubber: bool = False
    room: float = 0.0
    front_end: FrontEnd = field(default_factory=FrontEnd)

    @property
    def gauge(self) -> ForceGauge:
        """Gauge of the force; a hammer has one of the same kind at its tip."""
        return ForceGauge() if self.shaker is None else self.shaker.gauge


@dataclass(frozen=True, eq=False)
class BenchRig:
    """Outputs: the force as the gauge feels it [N], every accelerometer [m/s²], every opening [m].

    Its inputs: what drives (force of the coil, or of the hammer) [N], the sources of the room where
    it is loud, then a force at every site. On a shaker table the first of both is its acceleration
    [m/s²].
    """

    article: BenchArticle
    setup: BenchSetup
    model: PoleModel

    @property
    def measured(self) -> PoleModel:
        """Force and accelerations."""
        return self.model.outputs(slice(0, 1 + len(self.article.outputs)))

    @property
    def reference(self) -> ForceGauge:
        """Reference channel: a force gauge, or an accelerometer on the table."""
        kind = self.setup.accelerometer
        if self.article.on_table:
            return ForceGauge(0.0, 0.0, kind.sensitivity, kind.noise)
        return self.setup.gauge

    def called(self, frf: FRF) -> FRF:
        """Its quantity: motion over the table's motion, or acceleration over force."""
        return replace(frf, quantity="transmissibility") if self.article.on_table else frf

    @property
    def of_room(self) -> PoleModel:
        """Force and accelerations of the sources of the room."""
        return self.measured.inputs(slice(1, 1 + SOURCES))

    def room_density(self, band: tuple[float, float]) -> float:
        """Force density of every source [N/√Hz]; 0 in a silent room."""
        return room_density(self.of_room, self.setup.room, band) if self.setup.room else 0.0

    @property
    def openings(self) -> PoleModel:
        """Openings of the sites."""
        return self.model.outputs(slice(1 + len(self.article.outputs), None))

    def frf(self, frequency: np.ndarray) -> np.ndarray:
        """Acceleration per force as an ideal front end would find it (n_f, n_out)."""
        H = self.measured.response(2j * np.pi * np.asarray(frequency))[:, :, 0]
        return H[:, 1:] / H[:, :1]


@dataclass(eq=False)
class _Matrices:
    """M, C, K over modes, inner modes of cords and the armature, filled piece by piece."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray

    def add(self, rows: np.ndarray, M: np.ndarray, C: np.ndarray, K: np.ndarray) -> None:
        """rowsᵀ A rows of each."""
        for own, A in ((self.M, M), (self.C, C), (self.K, K)):
            own += rows.T @ A @ rows


def bench_rig(article: BenchArticle, setup: BenchSetup | None = None) -> BenchRig:
    """Couple all that is on the bench, and find its poles.

    Raises
    ------
    ModelError
        If an article on a shaker table is to have a shaker beside, or local forces.
    """
    setup = setup or BenchSetup()
    if article.on_table and (setup.shaker is not None or article.laws):
        raise ModelError(
            "a shaker table moves the supports, so it allows neither a shaker nor local forces"
        )
    r = len(article.frequency)
    usual = cords_for(article.weight, len(article.hangers), setup.rubber)
    cords = usual if setup.cords is None else setup.cords
    lines = 3 * INNER * len(article.hangers)
    n = r + lines + (setup.shaker is not None)

    def over(rows: np.ndarray) -> np.ndarray:
        """Rows over the modes as rows over all coordinates."""
        return np.concatenate([rows, np.zeros((*rows.shape[:-1], n - r))], axis=-1)

    m = _bare(article, n)
    mounts = over(article.mounts).reshape(-1, n)
    each = np.where(article.masses > 0, article.masses, setup.accelerometer.mass)
    each = each / article.channels
    m.M += mounts.T @ (np.repeat(each, 3)[:, None] * mounts)
    _hang(m, over(article.hangers), cords, r)
    load, P, through = np.zeros((n, 1)), [np.zeros((1, n)) for _ in range(3)], np.ones((1, 1))
    if article.on_table:
        load = over(article.base[None]).T
        with_base = np.repeat(each, 3) * article.mounts_with_base.ravel()
        load -= (with_base @ mounts)[:, None]
    elif setup.shaker is not None:
        load[-1], through = 1.0, np.zeros((1, 1))
        P = _shake(m, over(article.drive), setup.shaker)
    else:
        load = over(article.drive)[:1].T
    sites = over(article.sites)
    felt = over(article.outputs)
    at, speed, force = (
        np.vstack([P[0], 0 * felt, sites]),
        np.vstack([P[1], 0 * felt, 0 * sites]),
        np.vstack([P[2], felt, 0 * sites]),
    )
    room = over(room_loads(article).T).T if setup.room else np.zeros((n, 0))
    push = np.hstack([load, room, sites.T])
    whole = np.zeros((len(at), push.shape[1]))
    whole[0, 0] = through[0, 0]
    if article.on_table:
        whole[1 : 1 + len(felt), 0] = article.with_base
    model = by_poles((m.M, m.C, m.K), push, (at, speed, force), whole)
    return BenchRig(article, setup, _through_sensors(model, setup, len(article.outputs)))


def _bare(article: BenchArticle, n: int) -> _Matrices:
    """The article alone; its rigid motions swing."""
    r, rigid = len(article.frequency), ~article.elastic
    f = np.where(rigid, SWINGING * (1 + NARROW * np.arange(r)), article.frequency)
    zeta = np.where(rigid, RIGID_DAMPING, article.damping)
    w = 2 * np.pi * f
    M, C, K = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    at = np.arange(r)
    M[at, at], C[at, at], K[at, at] = 1.0, 2 * zeta * w, w**2
    C[:r, :r] += article.gyroscopic
    return _Matrices(M, C, K)


def _hang(m: _Matrices, hangers: np.ndarray, cords: tuple[Cord, ...], first: int) -> None:
    """Cords at the hangers (k, 3, n); the first direction is along the cord."""
    at = first
    for ends, one in zip(hangers, cords, strict=True):
        for way, end in enumerate(ends):
            rows = np.zeros((1 + INNER, len(end)))
            rows[0] = end
            rows[1 + np.arange(INNER), at + np.arange(INNER)] = 1.0
            m.add(rows, *cord_matrices(one, along=way == 0))
            at += INNER


def _shake(m: _Matrices, drive: np.ndarray, shaker: Shaker) -> list[np.ndarray]:
    """The shaker at the drive (6, n), and how the gauge's force is seen: P_d, P_v, P_a (1, n).

    The crystal feels the stinger's force less the inertia of the gauge's mass before it.
    """
    n, gauge, rod = drive.shape[1], shaker.gauge, shaker.stinger
    armature = np.zeros((1, n))
    armature[0, -1] = 1.0
    before = (1 - gauge.beyond) * gauge.mass
    none = np.zeros((1, 1))
    moving = np.array([[shaker.armature + rod.mass / 2]])
    m.add(armature, moving, np.array([[shaker.braking]]), np.array([[shaker.suspension]]))
    m.add(drive[:3], (gauge.mass + rod.mass / 2) * np.eye(3), np.zeros((3, 3)), np.zeros((3, 3)))
    stretch = armature - drive[:1]
    loss = np.array([[2 * 0.01 * np.sqrt(rod.axial * shaker.armature)]])
    m.add(stretch, none, loss, np.array([[rod.axial]]))
    across = rod.restraint()
    for way, slope in ((drive[1], drive[5]), (drive[2], -drive[4])):
        m.add(np.stack([way, slope]), 0 * across, 0 * across, across)
    return [rod.axial * stretch, loss * stretch, -(before + rod.mass / 2) * drive[:1]]


def _through_sensors(model: PoleModel, setup: BenchSetup, n_out: int) -> PoleModel:
    """The accelerations as the accelerometers show them: their own resonance, without its ringing.

    Their free decay at 18 kHz is shorter than a sample.
    """
    c = model.c.copy()
    c[1 : 1 + n_out] *= shown(setup.accelerometer, model.poles)
    return PoleModel(model.poles, model.b, c, model.d)
