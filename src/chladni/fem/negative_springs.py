"""Springs and bushes of negative stiffness: legal where the rest of the structure holds them."""

import numpy as np
import scipy.sparse as sp

from ..errors import AccuracyError, ModelError, named
from ..model.assembly import Assembly
from ..sparse.factor import inertia

_ROUNDING = 1e-8  # of K_ii, added before signs are counted: motions without stiffness are not < 0


def refuse_unstable(assembly: Assembly, K: sp.csr_array, dofs: np.ndarray) -> None:
    """Raise if K has negative eigenvalues, which only springs of negative stiffness give it.

    Sylvester's law counts them. A solver prints such eigenvalues; their motions grow without bound.

    Parameters
    ----------
    K : (n, n)       stiffness of the free dofs
    dofs : (n, 2)    their points and components
    """
    s, b = assembly.springs, assembly.bushes
    ids = np.concatenate([s.ids[s.value < 0], b.ids[(b.stiffness < 0).any(axis=1)]])
    if not len(ids):
        return
    lifted = sp.csr_array(K + _ROUNDING * sp.diags_array(np.abs(K.diagonal())))
    try:
        count, _ = inertia(lifted, nodes=dofs[:, 0])
    except AccuracyError:
        return  # the modes themselves decide
    if count:
        motions = "1 eigenvalue is" if count == 1 else f"{count} eigenvalues are"
        own = ids[ids > 0]  # elements of a direct matrix have no id
        who = [f"spring {named(own)} (CELAS, CBUSH)"] if len(own) else []
        who += ["the matrix K2GG"] if len(own) < len(ids) else []
        raise ModelError(
            f"{' or '.join(who)} has a negative stiffness, and the structure is "
            f"unstable with it: {motions} negative; correct its sign or stiffness, or remove it"
        )
