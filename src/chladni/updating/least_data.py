"""How much data a name needs: below it the answer is a list of what cannot be told apart.

E, rho and t are three unknowns; an effect brings up to three (strength and place); two numbers more
must be able to contradict it. A mode gives its frequency and, with responses in absolute scale, one
number more for every channel.
"""

import numpy as np

NUMBERS = 8  # 3 + 3 + 2, see above
MODES = 3  # of one mode a shift can be mass or stiffness; of two any place can be made to fit


def too_little(modes: int, channels: int) -> str:
    """Why nothing can be named from so many modes, each seen by so many fitted channels; or "".

    Channels are 0 where natural frequencies alone are compared.
    """
    numbers = modes * (1 + channels)
    if modes >= MODES and numbers >= NUMBERS:
        return ""
    seen = f" on {channels} channel{'s' * (channels != 1)}" if channels else ""
    due = max(MODES, int(np.ceil(NUMBERS / (1 + channels))))
    return (
        f"{modes} mode{'s' * (modes != 1)}{seen} cannot bear a name: {due} modes are the least, "
        "for three ordinary numbers, an effect of three and two that can contradict it"
    )
