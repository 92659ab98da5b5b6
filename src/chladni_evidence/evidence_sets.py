"""Which cases a set of evidence consists of; which seeds tune and which report."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from chladni.errors import LabelError
from chladni_specimens.forms import FORMS

from .bench_of_structure import TAILGATE, Bench, form_bench, panel_bench, tailgate_bench
from .benched_recording import PLAIN, Recorder
from .concealed import SPECIMENS
from .hidden_kinds import CATALOGUED
from .pair_kinds import PAIRS

SETS = ("tailgate", "panels", "forms", "outside", "joints", "pairs")
TUNING, REPORTING = range(500, 600), 600  # seeds; reporting ones are those from here on
MESHES = ("fine", "calculix")
ON_SHEETS = (
    "thickness-distribution", "orthotropic-material", "stiffness-patch", "mass-patch", "crack",
)  # fmt: skip
OURS = ("crack", "friction-joint")  # CalculiX has no card for them here
HOMES = {  # structures of the set outside, by what is put into them
    "rotor": ("lidded box", "ribbed plate", "curved shell", "panel"),
    "foam": ("panel", "curved shell", "bonded plates", "ribbed plate"),
    "local-resonator": ("tube frame", "lidded box", "plate", "ribbed plate"),
    "crack": ("plate", "bonded plates", "curved shell", "ribbed plate"),
    "friction-joint": ("lidded box", "bonded plates", "tube frame"),
    "duplicated-pair": ("panel", "bolted bracket", "bonded plates", "lidded box"),
}
JOINED = {  # structures of the set joints, by what is put into them
    "nothing": ("bonded plates", "lidded box", "bolted bracket"),
    "weld-missing": ("lidded box", "bolted bracket"),
    "adhesive-stiffness": ("bonded plates", "tailgate"),
    "hem-contact": ("tailgate",),
}


@dataclass(frozen=True)
class Order:
    """One case to be made."""

    structure: str
    kind: str
    seed: int
    mesh: str
    recorder: Recorder = PLAIN

    @property
    def name(self) -> str:
        """Name of its folder; what is hidden cannot be read from it."""
        mark = hashlib.sha256(f"{self.kind} {self.mesh}".encode()).hexdigest()[:6]
        return f"{self.structure.replace(' ', '-')}-{self.seed}-{mark}"

    def bench(self) -> Bench:
        """The structure on the bench."""
        if self.structure == "tailgate":
            return tailgate_bench()
        if self.structure in SPECIMENS:
            return panel_bench(self.structure, self.seed)
        return form_bench(self.structure, self.seed)


def orders(name: str, seeds: Sequence[int]) -> list[Order]:
    """All cases of a set.

    tailgate: every kind of the catalogue and both nulls, the meshes in turn.
    panels: the same on plate and panel, our fine mesh and CalculiX in turn.
    forms: on each form a null and one other kind, the kinds in turn.
    outside: every kind outside the catalogue, and those that came into it late, the structures in
    turn.
    joints: nothing, and every kind of joint at fault, on the structures that have it; our meshes.
    pairs: two effects at once on plate and panel, our fine mesh and CalculiX in turn.
    """
    made = {
        "tailgate": _tailgate,
        "panels": _panels,
        "forms": _forms,
        "outside": _outside,
        "joints": _joints,
        "pairs": _pairs,
    }
    if name not in made:
        raise LabelError(f"no set {name!r}; there are {', '.join(SETS)}")
    return [order for seed in seeds for order in made[name](seed)]


def _tailgate(seed: int) -> Iterator[Order]:
    meshes = list(TAILGATE)
    for k, kind in enumerate(CATALOGUED):
        yield Order("tailgate", kind, seed, _mesh(kind, meshes[(seed + k) % len(meshes)], meshes))


def _panels(seed: int) -> Iterator[Order]:
    for s, structure in enumerate(SPECIMENS):
        for k, kind in enumerate(CATALOGUED):
            yield Order(structure, kind, seed, _mesh(kind, MESHES[(seed + k + s) % 2]))


def _forms(seed: int) -> Iterator[Order]:
    for s, (name, form) in enumerate(FORMS.items()):
        kinds = [k for k in CATALOGUED if form.rolled or k not in ON_SHEETS][1:]
        for k, kind in enumerate(("nothing", kinds[(seed + 5 * s) % len(kinds)])):
            yield Order(name, kind, seed, _mesh(kind, MESHES[(seed + s + k) % 2]))


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


def _mesh(kind: str, mesh: str, meshes: Sequence[str] = MESHES) -> str:
    """The mesh, or the first where CalculiX has no card for the kind."""
    return meshes[0] if kind in OURS and mesh == "calculix" else mesh


def seed_range(text: str) -> range:
    """Seeds of a text as '600-604' or '600', both ends included.

    Raises
    ------
    LabelError
        If it is no range, or one that ends before it begins.

    >>> list(seed_range("600-602"))
    [600, 601, 602]
    """
    first, _, last = text.partition("-")
    last = last or first
    if not (first.isdecimal() and last.isdecimal() and int(first) <= int(last)):
        raise LabelError(f"seeds {text!r} are no range; write 600-604")
    return range(int(first), int(last) + 1)


def purpose(seeds: Sequence[int]) -> str:
    """What these seeds are for, in a sentence.

    Raises
    ------
    LabelError
        If some of them tune and others report, or some are for neither.
    """
    tuning = [s in TUNING for s in seeds]
    if all(tuning):
        return f"seeds {seeds[0]}-{seeds[-1]} are for tuning: never report them"
    if any(tuning) or min(seeds) < REPORTING:
        raise LabelError(
            f"seeds {seeds[0]}-{seeds[-1]}: {TUNING[0]}-{TUNING[-1]} tune, from {REPORTING} on "
            "they report; a run is for one or the other"
        )
    return f"seeds {seeds[0]}-{seeds[-1]} report: nothing may be looked up or tuned on them"
