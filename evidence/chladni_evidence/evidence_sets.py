"""Cases of each set of evidence, and the seeds that tune or report."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

from chladni.errors import LabelError, did_you_mean
from chladni_specimens import FORMS

from .bench_of_structure import (
    CLAMPED,
    SPECIMENS,
    TAILGATE,
    Bench,
    form_bench,
    panel_bench,
    tailgate_bench,
)
from .benched_recording import PLAIN, Recorder
from .hidden_kinds import CATALOGUED
from .made_case import KINDS, UNSIZED
from .package_kinds import package_kinds
from .pair_kinds import HEMS, PAIRS

SETS = (
    "tailgate",
    "panels",
    "forms",
    "frames",
    "outside",
    "joints",
    "pairs",
    "hems",
    "clamps",
    "kratos",
)
Purpose = Literal["tune", "report"]
PURPOSES: tuple[Purpose, ...] = get_args(Purpose)
REPORTING = 600  # seeds below tune scales and code; seeds from here on report
MESHES = ("fine", "calculix")
ON_SHEETS = (
    "thickness-distribution", "orthotropic-material", "stiffness-patch", "mass-patch", "crack",
    "membrane-prestress",
)  # fmt: skip
OURS = ("crack", "membrane-prestress", "friction-joint")  # CalculiX has no card for them here
HOMES = {  # structures of the set outside, by the hidden effect
    "rotor": ("lidded box", "ribbed plate", "curved shell", "panel"),
    "foam": ("panel", "curved shell", "bonded plates", "ribbed plate"),
    "local-resonator": ("tube frame", "lidded box", "plate", "ribbed plate"),
    "crack": ("plate", "bonded plates", "curved shell", "ribbed plate"),
    "friction-joint": ("lidded box", "bonded plates", "tube frame"),
    "duplicated-pair": ("panel", "bolted bracket", "bonded plates", "lidded box"),
}
JOINED = {  # structures of the set joints, by the hidden effect
    "nothing": ("bonded plates", "lidded box", "bolted bracket"),
    "weld-missing": ("lidded box", "bolted bracket"),
    "weld-run": ("lidded box", "tailgate"),
    "adhesive-stiffness": ("bonded plates", "tailgate"),
    "hem-contact": ("tailgate",),
    "hem-stretch": ("tailgate",),
    "viscoelastic-joint": ("bonded plates",),
}
FREE = ("half cylinder", "stringer plate", "cut-out plate", "covered trough")
OF_BARS = ("ladder of tubes",)
IN_CLAMPS = ("held plate", "cantilever", "curved blade")
HIDDEN_IN = {  # structures of the set kratos, by the hidden effect
    "point-mass": FREE + IN_CLAMPS + OF_BARS,
    "extra-support": IN_CLAMPS + FREE,
    "sensor-mass": ("held plate", "half cylinder", "cantilever", "cut-out plate"),
    "suspension": FREE,
    "thickness-distribution": ("cut-out plate", "curved blade", "half cylinder", "held plate"),
    "doubler": ("cantilever", "half cylinder", "stringer plate", "curved blade"),
    "stiffness-patch": ("half cylinder", "cantilever", "cut-out plate", "covered trough"),
    "mass-patch": ("stringer plate", "held plate", "covered trough", "curved blade"),
    "seam": ("cut-out plate", "curved blade", "half cylinder", "cantilever"),
    "rib": ("stringer plate", "cut-out plate", "half cylinder", "held plate"),
    "soft-clamp": IN_CLAMPS,
    "weld-missing": ("covered trough",),
    "stretched-sheet": ("held plate",),
    "shaker-restraint": ("cut-out plate", "half cylinder", "cantilever", *OF_BARS),
}
IN_CLAMP = ("nothing", "compliant-support", "shaker-restraint", "extra-support", "point-mass")


@dataclass(frozen=True)
class Order:
    """Order of one case."""

    structure: str
    kind: str
    seed: int
    mesh: str
    recorder: Recorder = PLAIN
    times: float | None = None  # size of the effect over scatter and mesh together; None: usual

    def bench(self) -> Bench:
        """The structure on the bench."""
        if self.structure == "tailgate":
            return tailgate_bench()
        if self.structure in {**SPECIMENS, **CLAMPED}:
            return panel_bench(self.structure, self.seed)
        return form_bench(self.structure, self.seed)


def orders(name: str, seeds: Sequence[int]) -> list[Order]:
    """All cases of a set.

    tailgate: every kind of the catalogue and both nulls, the meshes in turn.
    panels: the kinds of ``tailgate`` on plate and panel, our fine mesh and CalculiX in turn; and
    the effects of installed packages, on our mesh.
    forms: on each form a null and one other kind, the kinds in turn.
    frames: on the tube frame every kind of the catalogue that beams may have, and both nulls.
    outside: every kind outside the catalogue, and kinds that entered it late, the structures in
    turn.
    joints: nothing, and every kind of faulty joint, on the structures that have it; our meshes.
    pairs: two or three effects at once on plate and panel, our fine mesh and CalculiX in turn.
    hems: a tailgate whose hem cannot slide, all round or along a stretch, with a thinner sheet and
    sensors with mass; our mesh.
    clamps: nothing, a compliant clamp and similar effects, on a plate in a clamp; our mesh.
    kratos: structures unlike our specimens, by Kratos: six nulls and every kind of ``HIDDEN_IN``.
    """
    made = {
        "tailgate": _tailgate,
        "panels": _panels,
        "forms": _forms,
        "frames": _frames,
        "outside": _outside,
        "joints": _joints,
        "pairs": _pairs,
        "hems": _hems,
        "clamps": _clamps,
        "kratos": _kratos,
    }
    if name not in made:
        raise LabelError(f"no set {name!r}; there are {', '.join(SETS)}")
    return [order for seed in seeds for order in made[name](seed)]


def of_sizes(chosen: Sequence[Order], times: Sequence[float]) -> list[Order]:
    """Every order at each size; those whose effect has no size once, as they are."""
    return [
        replace(order, times=t)
        for order in chosen
        for t in ((None,) if order.kind in UNSIZED or not times else times)
    ]


def chosen(
    name: str, seeds: Sequence[int], kinds: Sequence[str] = (), structures: Sequence[str] = ()
) -> list[Order]:
    """The cases of a set, or of these kinds and structures alone.

    Raises
    ------
    LabelError
        If there is no such set, kind or structure, or no case is left.
    """
    whole = orders(name, seeds)
    hidden = tuple(dict.fromkeys([*KINDS, *(o.kind for o in whole)]))
    every = ("tailgate", *SPECIMENS, *CLAMPED, *FORMS, *FREE, *IN_CLAMPS, *OF_BARS)
    for what, chosen_words, known in (("kind", kinds, hidden), ("structure", structures, every)):
        for word in chosen_words:
            if word not in known:
                raise LabelError(
                    f"no {what} {word!r}; {did_you_mean(word, known)}there are {', '.join(known)}"
                )
    left = [
        o for o in whole if o.kind in (kinds or hidden) and o.structure in (structures or every)
    ]
    if not left:
        raise LabelError(
            f"no case of the set {name} is of these seeds, {', '.join((*kinds, *structures))}"
        )
    return left


def _tailgate(seed: int) -> Iterator[Order]:
    meshes = list(TAILGATE)
    for k, kind in enumerate(CATALOGUED):
        yield Order("tailgate", kind, seed, _mesh(kind, meshes[(seed + k) % len(meshes)], meshes))


def _panels(seed: int) -> Iterator[Order]:
    for s, structure in enumerate(SPECIMENS):
        for k, kind in enumerate(CATALOGUED):
            yield Order(structure, kind, seed, _mesh(kind, MESHES[(seed + k + s) % 2]))
        yield from (Order(structure, kind, seed, "fine") for kind in package_kinds(True))


def _forms(seed: int) -> Iterator[Order]:
    for s, (name, form) in enumerate(FORMS.items()):
        kinds = [k for k in CATALOGUED if form.rolled or k not in ON_SHEETS][1:]
        for k, kind in enumerate(("nothing", kinds[(seed + 5 * s) % len(kinds)])):
            yield Order(name, kind, seed, _mesh(kind, MESHES[(seed + s + k) % 2]))


def _frames(seed: int) -> Iterator[Order]:
    for k, kind in enumerate(kind for kind in CATALOGUED if kind not in ON_SHEETS):
        yield Order("tube frame", kind, seed, _mesh(kind, MESHES[(seed + k) % 2]))


def _outside(seed: int) -> Iterator[Order]:
    for k, (kind, homes) in enumerate(HOMES.items()):
        home = homes[(seed + k) % len(homes)]
        yield Order(home, kind, seed, _mesh(kind, MESHES[(seed + k) % 2]))


def _joints(seed: int) -> Iterator[Order]:
    for kind, homes in JOINED.items():
        yield from (Order(h, kind, seed, "16 mm" if h == "tailgate" else "fine") for h in homes)


def _pairs(seed: int) -> Iterator[Order]:
    for s, structure in enumerate(SPECIMENS):
        for k, kind in enumerate(PAIRS):
            yield Order(structure, kind, seed, MESHES[(seed + k + s) % 2])


def _hems(seed: int) -> Iterator[Order]:
    yield from (Order("tailgate", kind, seed, "16 mm") for kind in HEMS)


def _clamps(seed: int) -> Iterator[Order]:
    for structure in CLAMPED:
        yield from (Order(structure, kind, seed, "fine") for kind in IN_CLAMP)


def _kratos(seed: int) -> Iterator[Order]:
    every = FREE + IN_CLAMPS + OF_BARS
    for k in range(6):
        kind = "nothing" if k < 4 else "calibration"
        yield Order(every[(seed + k) % len(every)], kind, seed, "kratos")
    for kind, homes in HIDDEN_IN.items():
        yield Order(homes[seed % len(homes)], kind, seed, "kratos")


def _mesh(kind: str, mesh: str, meshes: Sequence[str] = MESHES) -> str:
    """The mesh, or the first one where CalculiX has no card for the kind."""
    return meshes[0] if kind in OURS and mesh == "calculix" else mesh


def seed_range(text: str) -> range:
    """Seeds of a text such as '600-604' or '600', both ends included.

    Raises
    ------
    LabelError
        If it is not a range, or ends before it begins.

    >>> list(seed_range("600-602"))
    [600, 601, 602]
    """
    first, _, last = text.partition("-")
    last = last or first
    if not (first.isdecimal() and last.isdecimal() and int(first) <= int(last)):
        raise LabelError(f"seeds {text!r} are not a range; write 600-604")
    return range(int(first), int(last) + 1)


def purpose(seeds: Sequence[int]) -> Purpose:
    """Purpose of these seeds: tune or report.

    Raises
    ------
    LabelError
        If some of them tune and others report.
    """
    tuning = [s < REPORTING for s in seeds]
    if any(tuning) != all(tuning):
        raise LabelError(
            f"seeds {min(seeds)}-{max(seeds)}: those below {REPORTING} tune, from {REPORTING} "
            "they report; a run has one purpose"
        )
    return "tune" if tuning[0] else "report"


MEANT: dict[Purpose, str] = {
    "tune": "these seeds are for tuning: never report them",
    "report": "these seeds report: do not inspect or tune on them",
}
