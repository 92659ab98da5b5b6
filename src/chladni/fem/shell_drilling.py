"""Drilling stiffness: it ties the rotation rz about the normal to the spin ω = ½ (v,x - u,y).

Two rules, each linear in its stiffness s [N/m]; a sheet usually has one of them:

    field      s ∫ (ω - rz)² dA              Hughes and Brezzi (1989), Comput. Methods Appl. Mech.
                                             Eng. 72, 105-121; s = 0.1 G t, of meshes made here
    corners    s Σ_i |J|_i (ω_i - rz_i)²     Nastran's PARAM,K6ROT: s = 1e-6 K6ROT G t; |J| is the
                                             Jacobian of the unit square at corner i of a CQUAD4
                                             (the area of a rectangle), twice the area of a CTRIA3

The second rule was identified from results, not taken from a manual. It reproduces the rotations
about the normal of MSC's results to 5e-8 on a bracket of rectangles and trapezoids (K6ROT 1). There
the field is wrong by 17 %, and the element's area for |J| by 1.4 %. On a plate without the
parameter, where 100 applies, it agrees to 4e-8 (field: 84 %). A free cylinder's frequencies agree
to 0.29 % (field: 0.50 %). On NX's wing box (K6ROT 100) the moments of 192 CBUSH on flat sheets give
s = 1.001e-4 G t. Twice the area of a CTRIA3 is based on MYSTRAN's comparison with MSC only
(MystranSolver, pull request 175).

Corners alone transfer little twist round a bend. At K6ROT 100 MacNeal-Harder's twisted beam is 1.64
times too soft (field 0.99) and Raasch's hook 1.26 times. Sheets of a tailgate change by 0.2 % in
frequency. Nastran corrects this by shell normals (SNORM). No manual states their formula, and no
result at hand determines it: the free cylinder above was computed without them. Therefore the
field is used for meshes that are made here. Beams with offsets on a sheet twist the rotation about
its normal, and there the field is too stiff. A stringer on a floor has its first mode at 22.06 Hz
with it and at 20.26 Hz with K6ROT 100. Another code has 20.31 Hz. Decks are read with Nastran's
100.
"""

import numpy as np

from . import triangle
from .shell_geometry import ShellGeometry, to_element
from .shell_membrane import corner_jacobians, corner_slopes, spin

VARYING_SPIN = 0.1  # squared: share of the drilling stiffness for the varying part of ω - rz


def damped(B: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The mean over the element plus a tenth of the varying part.

    Drilling stiffness transfers twist from element to element (MacNeal-Harder's twisted beam,
    Raasch's hook), and the mean is enough for this. The full field locks coarse doubly curved
    shells: a hemisphere of 8 x 8 is 3 % low. With a tenth it is 1 % high, as MacNeal's element.
    """
    share = weight / weight.sum(axis=1, keepdims=True)
    mean = (share[:, :, None, None, None] * B).sum(axis=1, keepdims=True)
    return mean + VARYING_SPIN * (B - mean)


def corner_twist(geo: ShellGeometry) -> np.ndarray:
    """√|J|_i (ω_i - rz_i) at the corners of shells of one shape from nodal motions: (m, 4, 24) [m].

    A triangle's fourth row is empty. Basic frame, nodal order ux uy uz rx ry rz.
    """
    three = bool(geo.triangle.any())
    omega = triangle.membrane(geo.corners)[1] if three else spin(corner_slopes(geo.corners))
    B = np.zeros((len(geo), 4, 4, 6))
    for i in range(3 if three else 4):
        B[:, i, :, :2] = omega[:, i].reshape(-1, 4, 2)
        B[:, i, i, 5] = -1
    J = 2 * geo.area[:, None] if three else corner_jacobians(geo.corners)
    return np.sqrt(J)[:, :, None] * B.reshape(len(geo), 4, 24) @ to_element(geo)
