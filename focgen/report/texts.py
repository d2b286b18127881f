"""A user's text on a page: names of files, columns, rigs, experiments, by one rule for each place.

Within the page's HTML the templates escape everything that is printed. The two places that HTML's rule does
not cover are here: data within a script, and text that the plotting library draws.
"""

from __future__ import annotations

import json
from typing import Any

from markupsafe import Markup

_ENDS = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"}


def data(value: Any) -> Markup:
    """``value`` as JSON within a ``<script>``: nothing in it can end the element or begin another."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return Markup("".join(_ENDS.get(char, char) for char in text))


def drawn(text: str) -> str:
    """Text that is drawn: one line; what cannot be seen, or turns the line about, becomes "?"."""
    return "".join(char if char.isprintable() else "?" for char in " ".join(text.split()))


def pictured(text: str) -> str:
    """Text in a picture of matplotlib: as it is, for dollar signs begin no formula."""
    return drawn(text).replace("$", r"\$")
