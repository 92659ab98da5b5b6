"""Least data to name an effect; with less, the answer lists effects that are indistinguishable.

E, rho and t are three unknowns, and an effect adds up to three (strength and place).  Two further
numbers must be able to contradict it. A mode gives its frequency and, with responses in absolute
scale, one further number for every channel.
"""

import numpy as np

NUMBERS = 8  # 3 + 3 + 2, see above
MODES = 3  # the shift of one mode can be mass or stiffness; with two modes any place fits


def too_little(modes: int, channels: int) -> str:
    """Reason why so many modes and fitted channels are too few to name an effect; or "".

    Channels are 0 where natural frequencies alone are compared.
    """
    numbers = modes * (1 + channels)
    if modes >= MODES and numbers >= NUMBERS:
        return ""
    seen = f" on {channels} channel{'s' * (channels != 1)}" if channels else ""
    due = max(MODES, int(np.ceil(NUMBERS / (1 + channels))))
    return (
        f"{modes} mode{'s' * (modes != 1)}{seen} cannot support a name: at least {due} modes are "
        "needed, three for the calibration parameters, three for an effect and two that can "
        "contradict it"
    )
