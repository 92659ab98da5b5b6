"""A parameter study from settings to table: nominal model, design, samples, sensitivities."""

import platform
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from chladni.arguments import checked, settings_of
from chladni.arrays import fingerprint
from chladni.case import Case
from chladni.case.free_parameters import fields_of
from chladni.dynamics.modes import ModalModel, rigid_modes
from chladni.errors import ChladniError, FileError, Interrupted
from chladni.io.nastran import units_of
from chladni.model.assembly import Assembly
from chladni.output import own_version, run_folder
from chladni.progress import Progress, remaining, silent
from chladni.results import Result
from chladni.units import Units
from chladni.workflows.case_model import REACH
from chladni.workflows.frf import refuse_unknown
from chladni.workflows.given_case import Source
from chladni.workflows.loaded_model import Model, as_model, opened

from .designs import Design, design
from .followed_modes import MARGIN, followed
from .sample import StudyModel, computed
from .sensitivity import Sensitivity, sensitivity, worth_telling
from .study_settings import StudySettings
from .study_store import OWN, StudyStore, opened_store, row_of, write_samples
from .variation import Variation, of_case, of_parts, refuse_impossible
from .varied_effects import of_effect
from .vary_text import VaryText, vary_text
from .workers import affordable, client_of, refuse_many, results

RESERVED = ("mode", "frequency", "mac", "done", "rms", "peak", "peak_hz", "frequency_hz",
            "frf_real", "frf_imag", "channel_name")  # names in the NetCDF file  # fmt: skip
_RIGID = 6  # rigid motions of a free structure in one piece


@dataclass(frozen=True, eq=False, repr=False)
class ParameterStudy(Result):
    """Samples of a model and their results.

    Attributes
    ----------
    varied : tuple of Variation     (d)
    settings : StudySettings
    design : Design                 points in the unit cube, in blocks that belong together
    X : (n, d)                      values of the parameters
    rows : (n) dicts                one per sample, in order; failed ones have no results
    nominal : dict                  the row of the deck's own values
    store : folder or None          folder of whole responses, if they were kept
    kept : samples that an earlier run had finished
    provenance : files with their hashes, versions, seed
    """

    varied: tuple[Variation, ...]
    settings: StudySettings
    design: Design
    X: np.ndarray
    rows: tuple[dict[str, Any], ...]
    nominal: dict[str, Any]
    store: Path | None
    kept: int
    provenance: dict[str, Any]
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return [v.name for v in self.varied]

    @property
    def columns(self) -> list[str]:
        """Names of the results."""
        skipped = {*OWN, *self.names}
        return [c for c in self.nominal if c not in skipped]

    @property
    def failed(self) -> list[tuple[int, str]]:
        """Number and reason of every sample without results."""
        return [(r["sample"], r["why"]) for r in self.rows if r["status"] == "failed"]

    def column(self, name: str) -> np.ndarray:
        """A result or parameter of every sample (n,); nan where there is none."""
        values = (row.get(name) for row in self.rows)
        return np.array([np.nan if v is None else v for v in values], dtype=float)

    def table(self) -> dict[str, list[Any]]:
        """Columns by name, for ``pandas.DataFrame``."""
        first = [*OWN, *self.names, *self.columns]
        return {name: [row.get(name) for row in self.rows] for name in first}

    @cached_property
    def sensitivities(self) -> tuple[Sensitivity, ...]:
        """Sensitivities of every result that is worth reporting."""
        U, by = self.design.points, (self.settings.sampler, self.design.block)
        return tuple(
            sensitivity(c, self.column(c), self.X, U, *by) for c in worth_telling(self.columns)
        )


@checked
def study(
    source: Source,
    vary: str | Sequence[str] = (),
    settings: StudySettings | None = None,
    *,
    out: Path | str | None = None,
    workers: int | None = 1,
    scheduler: Any = None,
    units: str | Units | None = None,
    allow: Sequence[str] = (),
    progress: Progress = silent,
    **words: Any,
) -> ParameterStudy:
    """Sample parameters of a model, in local processes or on any Dask cluster.

    Parameters
    ----------
    source : a model, a case, an Assembly, or the path of a deck or case
    vary : ranges as "t of inner=0.6:0.8", "E=90%:110%" or "point-mass at 412=0.01:0.2"; without
        any, the [[parameter]] of a case
    out : folder of the store, with ``samples.csv``: a study that was begun there continues where
        it stopped
    workers : local processes (a script that uses more than one needs the usual
              ``if __name__ == "__main__":``); None: one per core, or only this one for a study too
              short to start others
    scheduler : address of a Dask scheduler, or a ``distributed.Client``, instead of processes
    units : of a deck given by its path; without it numbers stay in the deck's own units
    allow : cards of the deck at a path to leave out although they carry stiffness
    words : fields of :class:`StudySettings` by name, as ``samples=50``

    Raises
    ------
    ChladniError
        One sentence: nothing to vary, a nominal model that cannot be solved, another study in the
        folder, a scheduler that does not answer.
    Interrupted
        By Ctrl-C; the sentence says what is kept.
    """
    if workers is not None:
        refuse_many(workers)
    settings = settings_of(StudySettings, settings, words)
    wanted = [vary_text(text) for text in ([vary] if isinstance(vary, str) else vary)]
    found = opened(source, units, allow)
    if isinstance(found, Case) and any(wanted_one.name == "suspension" for wanted_one in wanted):
        found = replace(found, given=tuple(g for g in found.given if g[1] != "hangers"))  # used
    model = as_model(found, "study")
    case = found if isinstance(found, Case) else None
    varied, notes = _varied(model, case, wanted)
    progress("the nominal model", 0.0)
    wanted_one = _study_model(model, case, varied, settings)
    own = np.array([v.nominal for v in varied])
    nominal = computed(wanted_one, -1, own)
    if nominal.why:
        raise FileError(
            f"{model.source}: the deck with its own values cannot be solved: {nominal.why}"
        )
    _refuse_taken([v.name for v in varied], nominal.columns)
    drawn = design(settings.sampler, settings.samples, len(varied), settings.seed,
                   _places(varied, own))  # fmt: skip
    X = np.stack([v.value(drawn.points[:, k]) for k, v in enumerate(varied)], axis=1)
    made = _provenance(model, case, varied, settings)
    names = [v.name for v in varied]
    rows: dict[int, dict[str, Any]] = {}
    stored = _store(out, wanted_one, drawn, made, names, X)
    with client_of(scheduler) as client, stored as store:
        before = dict(store.rows) if store else {}
        todo = [k for k in range(len(X)) if k not in before]
        rows |= before
        clock = _Clock(len(X), len(before), progress)
        try:
            many = min(workers or affordable(len(todo), nominal.seconds), max(1, len(todo)))
            for result in results(wanted_one, X, todo, many, client, clock.report):
                values = dict(zip(names, X[result.number].tolist(), strict=True))
                row = store.keep(result, values) if store else row_of(result, values)
                rows[result.number] = row
                clock.tick(len(rows))
        except KeyboardInterrupt:
            raise Interrupted(_kept(len(rows), len(X), store)) from None
        except ChladniError as error:
            raise type(error)(f"{error}; {_kept(len(rows), len(X), store)}") from error
        if case is not None and case.recordings and not case.frfs:
            notes.append("The recording has no FRFs, so there is no Q.")
        notes += [*drawn.notes, *(store.notes if store else [])]
    done = ParameterStudy(
        varied, settings, drawn, X, tuple(rows[k] for k in sorted(rows)),
        row_of(nominal, dict(zip(names, own.tolist(), strict=True))),
        None if out is None else Path(out), len(before), made, (*model.notes, *notes),
    )  # fmt: skip
    if out is not None:
        with run_folder(out, "study", adds=True) as part:
            write_samples(part / "samples.csv", done.table())
    return done


def _varied(
    model: Model, case: Case | None, vary: Sequence[VaryText]
) -> tuple[tuple[Variation, ...], list[str]]:
    """The varied parameters, and notes on them for the user."""
    notes: list[str] = []
    units = units_of(model.deck, model.units) if model.deck and model.units else model.units
    if vary:
        found = [
            of_effect(wanted_one, model.assembly, case, units)
            if wanted_one.is_effect
            else of_parts(wanted_one, model.assembly, model.deck, units)
            for wanted_one in vary
        ]
        if case is not None and case.parameters:
            notes = [
                "The [[parameter]] of the case are not used, because --vary defines the parameters."
            ]
    else:
        found, notes = of_case(case.parameters if case else (), model.assembly)
    if not found:
        raise FileError(f"{model.source}: no parameter is varied; {_choices(model.assembly)}")
    refuse_impossible(found, model.assembly)
    return tuple(found), notes


def _refuse_taken(names: Sequence[str], columns: Collection[str]) -> None:
    """Refuse parameters with the name of a column of the table, by FileError."""
    for name in names:
        if name in {*columns, *OWN, *RESERVED}:
            raise FileError(f"a parameter cannot be called {name!r}, as a column of the table is")


def _choices(assembly: Assembly) -> str:
    """The parameters that can be varied, as advice for an error message."""
    having = [(p.name, f) for k, p in enumerate(assembly.parts) if (f := fields_of(assembly, k))]
    if not having:
        return 'give for example --vary "K=50%:200%"'
    some = ", ".join(f"{name} ({', '.join(fields)})" for name, fields in having[:6])
    (name, fields), *_ = having
    return f'give --vary "{fields[0]} of {name}=90%:110%"; there are {some}'


def _places(varied: Sequence[Variation], own: np.ndarray) -> np.ndarray:
    """The deck's own values in the unit cube (d,); values outside [0, 1] lie outside the range.

    A value of zero has no logarithm: a logarithmic range then takes its lower end.
    """
    out = []
    for v, value in zip(varied, own, strict=True):
        if v.log and value == 0:
            out.append(0.0)
        elif v.log:
            out.append(np.log(value / v.low) / np.log(v.high / v.low))
        else:
            out.append((value - v.low) / (v.high - v.low))
    return np.array(out)


def _study_model(
    model: Model, case: Case | None, varied: tuple[Variation, ...], settings: StudySettings
) -> StudyModel:
    """The study model of every sample: nominal modes, and the frequency up to which to solve."""
    tested = case.tested(model.assembly) if case is not None else model.assembly
    whole = Model(model.source, tested, model.unit, (), model.length)
    if settings.inputs:
        refuse_unknown(whole, settings.outputs, settings.inputs)
    modes = followed(_elastic(whole, settings.modes), whole.places, settings.modes)
    if not len(modes.frequency):
        raise FileError(f"{model.source} has no elastic mode to follow")
    top = 0.0
    if case is not None and case.frfs:
        top = float(case.frfs[0].frequency[-1])
    if settings.inputs:
        top = max(top, settings.band[1])
    reach = max(REACH * top, MARGIN * float(modes.frequency[-1])) if top else 0.0
    plain = Model(model.source, model.assembly, model.unit, (), model.length)
    return StudyModel(plain, case, varied, settings, modes, reach)


def _elastic(whole: Model, count: int) -> ModalModel:
    """Normal modes with ``count`` elastic ones, of a structure in any number of loose pieces.

    Rounding makes rigid motions pass for elastic modes where there are few others.  So the number
    of modes is doubled until the number of rigid ones stays the same.
    """
    n = count + _RIGID
    modal = whole.normal_modes(n)
    while True:
        n, before = 2 * n, int(rigid_modes(modal).sum())
        modal = whole.normal_modes(n)
        rigid = int(rigid_modes(modal).sum())
        if len(modal) < n or (rigid == before and len(modal) - rigid >= count):
            return modal


@contextmanager
def _store(
    out: Path | str | None, wanted_one: StudyModel, drawn: Design, made: dict[str, Any],
    names: list[str], X: np.ndarray,
) -> Iterator[StudyStore | None]:  # fmt: skip
    if out is None:
        yield None
        return
    with opened_store(Path(out), _identity(wanted_one), made, names, X) as store:
        yield store


def _identity(wanted_one: StudyModel) -> dict[str, Any]:
    """Identity of a study: the contents of its files and settings, not names or folders."""
    s, case = wanted_one.settings, wanted_one.case
    measured: tuple[Any, ...] = ()
    if case is not None:
        measured = (*case.frfs[:1], case.outputs, case.inputs, case.band, case.exclude,
                    case.damping, case.gain_known, case.sensor_masses)  # fmt: skip
    rest = replace(s, samples=1, sampler="sobol", seed=0)
    return {
        "model": fingerprint((wanted_one.model.assembly, *measured)),
        "parameters": fingerprint(wanted_one.varied),
        "settings": fingerprint(rest),
        "sampler": s.sampler,
        "samples": s.samples,
        "seed": s.seed,
        "chladni": own_version(),
    }


def _provenance(
    model: Model, case: Case | None, varied: Sequence[Variation], settings: StudySettings
) -> dict[str, Any]:
    """Files with hashes, versions, ranges and seed: enough to repeat the study."""
    files = [s.path for s in model.deck.sources] if model.deck is not None else []
    if case is not None:
        files += [case.path]
    return {
        "source": str(model.source),
        "files": {str(p): sha256(p.read_bytes()).hexdigest() for p in files if p.is_file()},
        "versions": {
            "chladni": own_version(), "python": platform.python_version(),
            **{name: version(name) for name in ("numpy", "scipy", "SALib", "distributed")},
        },
        "sampler": settings.sampler, "samples": settings.samples, "seed": settings.seed,
        "parameters": [
            {"name": v.name, "field": v.free.field, "parts": v.free.parts, "nominal": v.nominal,
             "low": v.low, "high": v.high, "unit": v.unit, "log": v.log}
            for v in varied
        ],
    }  # fmt: skip


def _kept(done: int, n: int, store: StudyStore | None) -> str:
    if store is None:
        return f"{done} of {n} samples were finished and are lost, because no folder was given"
    return (
        f"{done} of {n} samples are kept in {store.folder}; the same command continues from there"
    )


class _Clock:
    """Rate and remaining time of the samples of this run."""

    def __init__(self, n: int, before: int, progress_to: Progress) -> None:
        self.n, self.before, self.progress_to = n, before, progress_to
        self.begun, self.done = 0.0, before
        progress_to(f"{before} of {n} samples", before / n)

    def report(self, what: str) -> None:
        """Report what the study waits for."""
        self.progress_to(what, self.done / self.n)

    def tick(self, done: int) -> None:
        """Report the number of finished samples, rate and remaining time."""
        if not self.begun:  # the start of workers does not count as time of samples
            self.begun, self.before = time.monotonic(), done
        self.done = done
        new, spent = done - self.before, time.monotonic() - self.begun
        said = f"{done} of {self.n} samples"
        if new and spent > 0:
            rate = new / spent
            said += f", {per_time(rate)}, {remaining((self.n - done) / rate)} left"
        self.progress_to(said, done / self.n)


def per_time(rate: float) -> str:
    """Samples a second, a minute or an hour.

    >>> per_time(3.21), per_time(0.05), per_time(0.002)
    ('3.2 a second', '3 a minute', '7.2 an hour')
    """
    for factor, word in ((1, "a second"), (60, "a minute")):
        if rate * factor >= 1:
            return f"{rate * factor:.2g} {word}"
    return f"{rate * 3600:.2g} an hour"
