"""Of two searches for several effects, which one goes on."""

from types import SimpleNamespace
from typing import cast

from chladni.search.several import Search, Several, _better


def test_of_two_searches_the_one_whose_set_pays_in_full_is_the_better():
    def search(*sets):
        each = (
            SimpleNamespace(pay=pay, hypothesis=SimpleNamespace(neg2_log_evidence=S))
            for pay, S in sets
        )
        return Search(cast(tuple[Several, ...], tuple(each)), "")

    none, part, paid, more = (
        search(),
        search((False, -90)),
        search((True, -50)),
        search((True, -60)),
    )
    assert _better(part, paid) is _better(paid, part) is paid
    assert _better(paid, more) is more
    assert _better(paid, search((True, -60), (False, -99))).sets[0].pay
    assert _better(none, part) is _better(part, none) is part
    assert _better(none, search()) is none
