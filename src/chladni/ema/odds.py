"""Bayes factors in words (Kass and Raftery 1995, J. Am. Stat. Assoc. 90, 773-795, section 3.2)."""

_SCALE = ((1.0, "hardly any"), (3.0, "positive"), (5.0, "strong"))  # up to ln B


def evidence_in_words(log_bayes_factor: float) -> str:
    """Strength of evidence, with 2 ln B, which is read on the scale of a χ².

    >>> evidence_in_words(0.4), evidence_in_words(699.2)
    ('hardly any evidence (2 ln B = 0.8)', 'very strong evidence (2 ln B = 1398)')
    """
    word = next((w for most, w in _SCALE if log_bayes_factor <= most), "very strong")
    twice = 2 * log_bayes_factor
    return f"{word} evidence (2 ln B = {twice:.{0 if abs(twice) >= 10 else 1}f})"
