"""Twenty modes of a free solid of CTETRA10: this package against its peers.

    python benchmarks/solid.py             # 300 thousand dofs
    python benchmarks/solid.py 30          # a tenth of that, two minutes
    python benchmarks/solid.py 300 --without superlu

Every figure is the processor time of one thread in a process of its own, from matrices in memory to
modes in memory, of one run; the peak is that process's resident set. CHOLMOD needs scikit-sparse.
"""

import argparse

import numpy as np

import eigen

COUNT, FIRST = 20, 2750.0  # modes, the first elastic frequency [Hz]
SIZE = 0.5, 0.4, 0.3  # [m]
# six tetrahedra of a brick round its diagonal from corner 0 to 7, corners as bits z y x
_SIX = ((0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7))


def specimen(thousands):
    """The system of a steel block of about so many thousand dofs."""
    from chladni.fem.assemble import structure
    from chladni.geometry.solid_shapes import EDGES
    from chladni.model.assembly import Assembly, Solids
    from chladni.model.properties import Isotropic, Part, SolidSection

    edge = (24.0 * np.prod(SIZE) / (1000 * thousands)) ** (1 / 3)  # eight nodes a brick
    n = [max(1, round(s / edge - 0.5)) for s in SIZE]  # 2 n + 1 nodes
    z, y, x = np.meshgrid(*(np.arange(k) for k in n[::-1]), indexing="ij")
    corner = [
        (x + (b & 1)) + (n[0] + 1) * ((y + (b >> 1 & 1)) + (n[1] + 1) * (z + (b >> 2)))
        for b in range(8)
    ]
    corner = np.stack([c.ravel() for c in corner], axis=1)
    tets = corner[:, _SIX].reshape(-1, 4)
    axes = [np.linspace(0, s, k + 1) for s, k in zip(SIZE, n, strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    ends = np.sort(tets[:, EDGES[4]].reshape(-1, 2), axis=1)
    edges, at = np.unique(ends, axis=0, return_inverse=True)
    nodes = np.hstack([tets, len(points) + at.reshape(len(tets), -1)])
    points = np.vstack([points, points[edges].mean(axis=1)])
    steel = Part(1, "block", SolidSection(Isotropic(210e9, 0.3, 7850.0)))
    number = np.arange(1, len(nodes) + 1)
    solids = Solids(number, nodes, np.zeros(len(nodes), np.int64))
    made = Assembly(np.arange(1, len(points) + 1), points, (steel,), solids=(solids,))
    return structure(made).system


def main():
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sizes", nargs="*", type=int, default=[300], help="thousands of dofs")
    parser.add_argument("--without", nargs="*", default=[], help="parts of names to leave out")
    arguments = parser.parse_args()
    for thousands in arguments.sizes:
        eigen.compare(specimen(thousands), COUNT, FIRST, arguments.without)


if __name__ == "__main__":
    main()
