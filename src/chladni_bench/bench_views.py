"""How virtual tests are shown, saved and written as JSON; importing this module registers it."""

from chladni.report.result_views import Paged
from chladni.results import show_by

from .bench_folder import write_bench
from .bench_workflow import BenchResult

_PAGED = Paged(
    "bench",
    f"{__package__}.bench_page",
    "bench.json",
    lambda found, at: write_bench(at, found.origin, found),
)

show_by(BenchResult, _PAGED.view)
