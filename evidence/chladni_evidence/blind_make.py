"""Making of blind cases: truths are sealed, and their hashes published before any answer."""

import hashlib
import json
import multiprocessing
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np

from chladni.errors import FileError, LabelError
from chladni.output import locked, make_folder, own_version, write_json, write_text
from chladni.own_folder import own_folder
from chladni.parallel import one_blas_thread
from chladni_bench import scattered_parts

from . import kratos
from .blind_folder import BlindFolder, Seals, hash_of, hash_of_case, published, read_json
from .evidence_sets import MEANT, Order, Purpose, purpose
from .interval_evidence import of_prior
from .leash import leash_to_parent
from .made_case import MadeCase, made_case, write_case

Say = Callable[[str], object]


def make(
    chosen: Sequence[Order], out: Path, why: Purpose, set_name: str, workers: int, say: Say
) -> Seals:
    """Make all cases and publish the hashes of their truths; existing cases are kept.

    A case that cannot be made does not stop the others; the reason is sealed with the truths.

    Raises
    ------
    LabelError
        If the seeds are not for this purpose.
    FileError
        If the folder holds anything else, or Kratos is needed and not installed.
    """
    if any(o.mesh == "kratos" for o in chosen):
        kratos.needed()
    seeds = sorted({o.seed for o in chosen})
    if purpose(seeds) != why:
        raise LabelError(
            f"seeds {seeds[0]}-{seeds[-1]} are for {purpose(seeds)}, not for {why}; seeds that "
            "tune and seeds that report must differ"
        )
    place = BlindFolder(out)
    make_folder(out)
    with locked(out):
        orders = _begun(place, chosen)
        if not place.seals.exists():
            _each(orders, place, workers, say)
            _seals(place, orders, why, set_name, f"{seeds[0]}-{seeds[-1]}").write(place.seals)
        found = published(place)
    say(f"{len(found.truths)} cases sealed, {found.failed} could not be made; {MEANT[why]}")
    say(f"SHA-256 of {place.seals}: {hash_of(place.seals)}")
    return found


def _begun(place: BlindFolder, chosen: Sequence[Order]) -> dict[str, Order]:
    """Orders by name; names are drawn, so that they do not reveal the hidden effect."""
    text = json.dumps([vars(o) for o in chosen])
    mark = hashlib.sha256(text.encode())
    begun = place.out / "blind.json"
    if begun.exists():
        if read_json(begun, "").get("orders") != mark.hexdigest():
            raise FileError(f"{place.out} has other blind cases; give another --out")
    elif any(place.out.iterdir()):
        raise FileError(f"{place.out} has other files; give another --out")
    else:
        write_json(begun, {"orders": mark.hexdigest(), "cases": len(chosen)})
    drawn = np.random.default_rng(list(mark.digest())).permutation(len(chosen))
    wide = len(str(len(chosen)))
    return {f"case-{k:0{wide}}": chosen[int(i)] for k, i in enumerate(drawn, 1)}


def _each(orders: dict[str, Order], place: BlindFolder, workers: int, say: Say) -> None:
    """Make each case and report it."""
    if workers == 1:
        for done, (name, order) in enumerate(orders.items(), 1):
            say(_said(name, _made(name, order, place), done, len(orders)))
        return
    with ProcessPoolExecutor(workers, initializer=leash_to_parent) as pool:
        jobs = {pool.submit(_made, name, order, place): name for name, order in orders.items()}
        try:
            for done, job in enumerate(as_completed(jobs), 1):
                say(_said(jobs[job], job.result(), done, len(orders)))
        except BrokenProcessPool as error:
            raise FileError(
                "a process that made cases was ended from outside, possibly by too little "
                "memory; the same command continues, with fewer --workers"
            ) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in multiprocessing.active_children():
                child.terminate()
            raise


def _said(name: str, made: bool, done: int, every: int) -> str:
    return f"{name} {'made' if made else 'NOT MADE'}, {done} of {every}"


def _made(name: str, order: Order, place: BlindFolder) -> bool:
    """Make a case folder and its truth, written last so that a truth means a whole case."""
    truth, cache = place.truth(name), place.out / "cache"
    if truth.exists():
        return True
    with own_folder(place.out) as here:
        for folder in ("cases", "sealed", "cache"):
            here.make(folder)
        here.remove(f"cases/{name}")  # remains of a run that was killed
    try:
        write_case(made_of(order, cache), place.case(name), truth)
    except Exception:  # noqa: BLE001  a maker that fails is counted, and the others go on
        write_text(_why_not(place, name), traceback.format_exc())
        return False
    _why_not(place, name).unlink(missing_ok=True)
    return True


def made_of(order: Order, cache: Path | None = None) -> MadeCase:
    """The case of an order, made on one thread so that it is the same on every machine."""
    draw = of_prior if order.mesh == "kratos" else scattered_parts
    with one_blas_thread():
        return made_case(
            order.bench(), order.kind, order.seed, order.mesh, cache, order.recorder, order.times,
            draw,
        )  # fmt: skip


def _why_not(place: BlindFolder, name: str) -> Path:
    """Path of the reason for a failed case; sealed, because it reveals the hidden effect."""
    return place.truth(name).with_suffix(".failed.txt")


def _seals(
    place: BlindFolder, orders: dict[str, Order], why: Purpose, set_name: str, seeds: str
) -> Seals:
    made = [name for name in orders if place.truth(name).exists()]
    if not made:
        raise FileError(f"no case could be made; see {place.out / 'sealed'}")
    return Seals(
        why, set_name, seeds, own_version(), len(orders) - len(made),
        {name: hash_of(place.truth(name)) for name in made},
        {name: hash_of_case(place.case(name)) for name in made},
    )  # fmt: skip
