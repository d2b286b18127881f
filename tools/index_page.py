"""The README as a package index shows it, where relative addresses lead nowhere.

Hatchling calls this when it builds. Where ``[project.urls]`` of pyproject.toml has a ``Source``, pictures and
pages get addresses below it. Where it has none, a picture is left out; its words stay, and those of a link.
"""

from __future__ import annotations

import re
from pathlib import Path

try:
    from hatchling.metadata.plugin.interface import MetadataHookInterface
except ModuleNotFoundError:  # the tests call `index_page` without a builder
    MetadataHookInterface = object

_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?://|#)([^)\s]+)\)")


def index_page(readme: str, source: str = "") -> str:
    """``readme`` without relative addresses; ``source`` is that of the repository, or empty."""

    def absolute(link: re.Match) -> str:
        picture, words, path = link.groups()
        if not source:
            return f"*{words}*" if picture else words
        return f"{picture}[{words}]({source.rstrip('/')}/{'raw' if picture else 'blob'}/HEAD/{path})"

    return _LINK.sub(absolute, readme)


class IndexPage(MetadataHookInterface):
    """Fills in the field ``readme``."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict) -> None:
        """Called with the table ``[project]``."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        page = index_page(text, metadata.get("urls", {}).get("Source", ""))
        metadata["readme"] = {"content-type": "text/markdown", "text": page}
