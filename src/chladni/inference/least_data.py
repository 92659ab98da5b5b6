"""Data so few that they bear a name only if all other explanations are far behind, or none at all.

E, rho and t are three unknowns, and an effect adds up to three (strength and place).  Two further
numbers must be able to contradict it. A mode gives its frequency and, with responses in absolute
scale, one further number for every channel.  Priors of E, rho and t replace their three numbers
where the odds between explanations are large; nothing replaces the others.
"""

import numpy as np

NUMBERS = 8  # 3 + 3 + 2, see above
CONTRADICTED = 5  # 3 + 2: with fewer, any effect fits
MODES = 3  # the shift of one mode can be mass or stiffness; with two modes any place fits


def numbers(modes: int, channels: int) -> int:
    """Return how many numbers so many modes and fitted channels give.

    Channels are 0 where natural frequencies alone are compared.
    """
    return modes * (1 + channels)


def too_little(modes: int, channels: int) -> str:
    """Reason why so many modes and fitted channels rarely separate explanations; or ""."""
    if modes >= MODES and numbers(modes, channels) >= NUMBERS:
        return ""
    seen = f" on {channels} channel{'s' * (channels != 1)}" if channels else ""
    few = f"{modes} fitted mode{seen} does" if modes == 1 else f"{modes} fitted modes{seen} do"
    due = max(MODES, int(np.ceil(NUMBERS / (1 + channels))))
    why = (
        f"{modes} frequenc{'y' if modes == 1 else 'ies'} can follow from mass as well as stiffness"
        if due == MODES
        else f"they give {numbers(modes, channels)} numbers, and the calibration parameters take "
        "three, an effect three, and two must be able to contradict it"
    )
    return (
        f"{few} not separate the explanations: at least {due} modes are needed, because {why}; "
        "held-out data do not count"
    )
