"""Formulas as MathML, which browsers draw themselves: no script, no font, no network."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

_APPLIED = "<mo>&ApplyFunction;</mo>"
_SPACE = '<mspace width="0.17em"></mspace>'  # as TeX sets it about ln, det, tr
_BEFORE = re.compile(rf"(</m(?:n|i|sub|sup|subsup|frac|row)>)(?=\s*<mi[^>]*>\w+</mi>\s*{_APPLIED})")
_BAR = '<mo stretchy="false">|</mo>'
_FENCED = re.compile(
    r"<mo>([(\[{|])</mo>((?:(?!<mo>[(\[{|]</mo>).)*?)<mo>([)\]}|])</mo>", re.DOTALL
)
_HIGH = re.compile("<mfrac>|<munder")
_STRETCHED = '<mo stretchy="false" class="stretched">{}</mo>'
_AFTER = re.compile(rf"{_APPLIED}(?!\s*<mo stretchy|\s*<mrow>\s*<mo>)")


def setup(app: Any) -> None:
    """Register the renderer ``mathml``."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))


def formula(text: str, as_block: bool = False) -> str:
    r"""A formula of TeX as MathML, with what browsers leave out.

    These are the thin spaces of 2 ln p, and the brackets of ``\left`` and ``\right``, which only a
    font for formulas stretches: the style sheet does. A bar of |x| has no space about it.
    """
    made = _BEFORE.sub(rf"\1{_SPACE}", tex2mathml(text, as_block=as_block))
    made = made.replace(_BAR, _BAR.replace(">", ' lspace="0" rspace="0">', 1))
    return _FENCED.sub(_stretched, _AFTER.sub(f"{_APPLIED}{_SPACE}", made))


def _stretched(found: re.Match[str]) -> str:
    """A pair of brackets as high as a fraction or a sum between them."""
    if not _HIGH.search(found[2]):
        return found[0]
    return _STRETCHED.format(found[1]) + found[2] + _STRETCHED.format(found[3])


def _inline(writer: Any, node: nodes.Element) -> None:
    writer.body.append(formula(node.astext()))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.Element) -> None:
    writer.body.append(f'<div class="formula">{formula(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode
