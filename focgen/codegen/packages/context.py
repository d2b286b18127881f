"""What every package is made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import focgen
from focgen.codegen.render import render
from focgen.plan.plan import Plan
from focgen.resources import shipped


@dataclass(frozen=True, eq=False)
class Made:
    """A plan and its C: ``files``, name and content of what is compiled; ``package`` and ``fmi`` as in
    :class:`~focgen.codegen.packages.package.Package`.
    """

    plan: Plan
    files: Mapping[str, str | bytes]
    package: str
    fmi: int | None

    @property
    def sources(self) -> list[str]:
        """The C files, in order."""
        return sorted(name for name in self.files if name.endswith(".c"))

    @property
    def headers(self) -> list[str]:
        """The headers that a program includes: the runtime's are the C's own."""
        return sorted(name for name in self.files if name.endswith(".h") and not name.startswith("foc_"))


@dataclass(frozen=True)
class BuildContext:
    """What the templates of build files ask for."""

    name: str
    version: str
    sources: list[str]
    headers: list[str]
    keywords: list[str]


def build_context(made: Made, keywords: Sequence[str] = ()) -> BuildContext:
    """Prepare it; ``keywords``: what an editor shall colour."""
    return BuildContext(made.plan.name, release(), made.sources, made.headers, list(keywords))


def release() -> str:
    """The version in three numbers, as build systems take it."""
    numbers = focgen.__version__.split("+")[0].split(".")[:3]
    return ".".join("".join(filter(str.isdigit, part)) or "0" for part in (*numbers, "0", "0")[:3])


def rendered(folder: str, context: object, *names: tuple[str, str]) -> dict[str, str | bytes]:
    """Files by their names in the folder, each from a template of ``templates/packages/FOLDER``."""
    return {name: render(f"packages/{folder}/{template}", context) for name, template in names}


def licence() -> str:
    """The text of the licence that generated C is under."""
    return (shipped("c_runtime") / "LICENSE").read_text(encoding="utf-8")
