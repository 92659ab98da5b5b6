"""Data so few that they support a name only if all other explanations are far behind.

The calibration parameters take the numbers that their priors do not know. These are three at most
for E, rho and t of one sheet, and none of a part whose values are known. An effect adds up to three
(strength and place).  Two further numbers must be able to contradict it. A mode gives its frequency
and, with responses in absolute scale, one further number for every channel.  Fewer support a name
by odds alone, if calibration leaves a number over.
"""

import numpy as np

TAKEN = 3.0  # numbers that E, rho and t of one sheet take
EFFECT = 5  # 3 + 2, see above
NUMBERS = int(TAKEN) + EFFECT
CONTRADICTED = 1.0  # number beyond those that calibration takes: with less it fits anything
MODES = 3  # the shift of one mode can be mass or stiffness; with two modes any place fits


def numbers(modes: int, channels: int) -> int:
    """Return how many numbers so many modes and fitted channels give.

    Channels are 0 where natural frequencies alone are compared.
    """
    return modes * (1 + channels)


def too_little(modes: int, channels: int, taken: float = TAKEN) -> str:
    """Reason why so many modes and fitted channels rarely separate explanations; or "".

    The calibration parameters take ``taken`` numbers in effect.
    """
    if modes >= MODES and numbers(modes, channels) >= taken + EFFECT:
        return ""
    seen = f" on {channels} channel{'s' * (channels != 1)}" if channels else ""
    few = f"{modes} fitted mode{seen} does" if modes == 1 else f"{modes} fitted modes{seen} do"
    due = max(MODES, int(np.ceil((taken + EFFECT) / (1 + channels))))
    why = (
        f"{modes} frequenc{'y' if modes == 1 else 'ies'} can follow from mass as well as stiffness"
        if due == MODES
        else f"they give {numbers(modes, channels)} numbers, and the calibration parameters take "
        f"{taken:.2g} in effect, an effect three, and two must be able to contradict it"
    )
    return (
        f"{few} not separate the explanations: at least {due} modes are needed, because {why}; "
        "held-out data do not count"
    )
