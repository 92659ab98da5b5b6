"""Make the demonstration case: a panel with something concealed, recorded on our own bench.

Run from the checkout: ``python meshes/make_demo.py``; it writes ``demo/`` and ``demo.truth.json``.
"""

from pathlib import Path

from chladni_evidence.concealed import SPECIMENS, made, write

HERE = Path(__file__).resolve().parent

if __name__ == "__main__":
    case = made(SPECIMENS["panel"], "point-mass", 7)
    write(case, HERE / "demo", HERE / "demo.truth.json")
