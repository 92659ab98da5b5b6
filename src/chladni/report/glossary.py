"""Words of the page with an explanation that appears under the pointer."""

GLOSSARY = {
    "Q": "Mean over channels and lines of |log10(H model / H test)|²; 0 is perfect, 0.1 a factor "
    "of 2 (rms).",
    "Q of": "The data over which the mean goes.",
    "MAC": "Modal assurance criterion: squared cosine between two shapes at the sensors; 1: the "
    "same shape.",
    "CoMAC": "MAC at one sensor over all paired modes. A low value may mean a wrong place or "
    "direction.",
    "held out": "Sensors and bands that were not fitted. They test the result: a wrong "
    "explanation does not improve them.",
    "log evidence": "Logarithm of the probability of the recording under an explanation, all its "
    "parameters averaged over. Free parameters that do not improve the fit lower "
    "it.",
    "Bayes factor": "The ratio of two such probabilities: how many times better one explanation "
    "predicts the recording than another.",
    "95 % interval": "If the explanation is right, it contains the true value in 19 of 20 cases.",
    "damping": "Ratio ζ to critical damping; a peak is 1/2ζ times as high as the static response.",
    "drive point": "Place where the force acts.",
    "floor": "Q from the noise of the recording alone.",
    "off": "Deviation from the test.",
    "FRF": "Frequency response function: motion over force at every frequency.",
}
_HEADS = {  # heads of tables and names of facts that hold a word of the glossary
    "Q, fitted data": "Q", "Q, held-out data": "held out", "Held-out deviation Q": "held out",
    "Q fitted": "Q", "Q held out": "held out", "MAC before": "MAC", "MAC after": "MAC",
    "Q before": "Q", "Q after": "Q",
    "found (95 % interval)": "95 % interval",
    "compared with the best": "Bayes factor", "damping [%]": "damping", "off ": "off",
}  # fmt: skip


def meaning(head: str) -> str:
    """Return the meaning of a table head or a fact; "" if it needs none.

    >>> meaning("MAC after") == GLOSSARY["MAC"], meaning("parameter")
    (True, '')
    """
    return GLOSSARY.get(_HEADS.get(head, head), "")
