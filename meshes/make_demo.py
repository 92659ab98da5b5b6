"""Make the demonstration case: a panel with something concealed in it, solved by CalculiX.

Run from the checkout: ``python meshes/make_demo.py``; it writes ``demo/`` and ``demo.truth.json``
anew. CalculiX (``ccx``) has to be installed for that.
"""

from pathlib import Path

from chladni_evidence.blind_make import made_of
from chladni_evidence.evidence_sets import Order
from chladni_evidence.made_case import write_case

HERE = Path(__file__).resolve().parent

if __name__ == "__main__":
    case = made_of(Order("panel", "point-mass", 560, "calculix"))
    write_case(case, HERE / "demo", HERE / "demo.truth.json")
