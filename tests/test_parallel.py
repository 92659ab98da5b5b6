"""Work in threads: the order kept, few results at once, faults said, the answer what it was."""

import warnings
from threading import Barrier

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import chladni
from chladni import parallel as module
from chladni.dynamics import eigen
from chladni.errors import ModelError
from chladni.io.package_files import mesh_path
from chladni.parallel import cores, in_parallel, one_blas_thread, threads
from chladni.sparse.lanczos import block_lanczos


@pytest.mark.parametrize("at_once", [1, 2, 3])
def test_results_come_in_order_and_few_wait(at_once):
    begun = []

    def work(k):
        begun.append(k)
        return k**2

    for taken, square in enumerate(in_parallel(work, range(20), at_once)):
        assert square == taken**2
        assert len(begun) <= taken + 1 + at_once
    assert sorted(begun) == list(range(20))


def test_two_are_at_work_at_the_same_time():
    """Each waits for the other: one after the other they would never end."""
    met = Barrier(2, timeout=30)
    assert set(in_parallel(lambda k: met.wait(), range(2), 2)) == {0, 1}


def test_a_fault_is_raised_where_it_is_asked_for_and_the_rest_is_not_begun():
    begun = []

    def work(k):
        begun.append(k)
        if k == 1:
            raise ModelError("the second")
        return k

    done = in_parallel(work, range(50), 2)
    assert next(done) == 0
    with pytest.raises(ModelError, match="the second"):
        list(done)
    assert len(begun) < 10


def test_who_stops_asking_ends_the_rest():
    begun = []
    done = in_parallel(lambda k: begun.append(k) or k, range(50), 2)
    assert next(done) == 0
    done.close()
    assert len(begun) < 10


def test_what_is_said_of_rounding_holds_in_threads():
    with warnings.catch_warnings(), np.errstate(divide="ignore"):
        warnings.simplefilter("error")
        assert list(in_parallel(lambda x: np.log(x), np.zeros(4), 2)) == [-np.inf] * 4


def test_as_many_threads_as_the_user_allows(monkeypatch):
    monkeypatch.setattr(module, "cores", lambda: 8)
    for said, count in (("1", 1), ("3", 3), ("3,2", 3), ("64", 4), ("", 4), ("0", 4), ("many", 4)):
        monkeypatch.setenv("OMP_NUM_THREADS", said)
        assert threads() == count
    monkeypatch.delenv("OMP_NUM_THREADS")
    assert threads() == 4
    monkeypatch.setattr(module, "cores", lambda: 2)
    assert threads() == 2
    monkeypatch.undo()
    assert cores() >= 1


def blas_threads():
    return {lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"}


def test_blas_keeps_one_thread_until_the_last_that_asks_for_it_has_left():
    """Threads overlap as they please; the number is of the process."""
    with threadpool_limits(2, user_api="blas"):
        first, second = one_blas_thread(), one_blas_thread()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert blas_threads() == {1}
        second.__exit__(None, None, None)
        assert blas_threads() == {2}


def test_a_model_is_solved_on_one_thread_of_blas_from_python_too(monkeypatch):
    """The panel's modes, as a script asks for them: what commands do holds for whoever calls."""
    seen = []

    def looking(*args, **kwargs):
        seen.append(blas_threads())
        return block_lanczos(*args, **kwargs)

    monkeypatch.setattr(eigen, "block_lanczos", looking)
    with threadpool_limits(2, user_api="blas"):
        chladni.load(mesh_path("demo/deck.bdf"), "mm-t-s").modes(8)
        assert blas_threads() == {2}
    assert seen == [{1}] * len(seen)
    assert seen
