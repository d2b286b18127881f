"""Which ecosystem a folder is made for, and the files that this adds to the plain ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from focgen.codegen.packages.arduino import arduino_files
from focgen.codegen.packages.cmake import cmake_files
from focgen.codegen.packages.context import Made
from focgen.codegen.packages.fmu import fmu_files
from focgen.codegen.packages.platformio import platformio_files
from focgen.errors import InputError, check_choice

_FILES: Mapping[str, Callable[[Made], dict[str, str | bytes]]] = {
    "plain": lambda made: {},
    "cmake": cmake_files,
    "arduino": arduino_files,
    "platformio": platformio_files,
    "fmu": fmu_files,
}
PACKAGES = tuple(_FILES)
_ABSENT = {"zephyr": "is not offered, since Zephyr's own check of a module cannot be run here"}
_INSTEAD = "leave --for out and add the plain folder to the application; docs/packages.md has the lines"
FMI = (2, 3)
"""Versions of the Functional Mock-up Interface: 2.0 and 3.0."""
README = "README.md"
_EXAMPLE = "example/main.c"
_ARDUINO_EXAMPLE = "extras/example/main.c"  # Arduino reads a folder example/ as a misspelled examples/


@dataclass(frozen=True)
class Package:
    """An ecosystem by its ``name``, and for an FMU the version of its interface, 2 or 3."""

    name: str = "plain"
    fmi: int | None = None

    @property
    def entry(self) -> dict[str, str | int]:
        """What a manifest says of it."""
        return {"for": self.name} | ({"fmi": self.fmi} if self.fmi else {})


PLAIN = Package()


def check_package(name: str, fmi: int | None = None) -> Package:
    """The package of these options; an FMU's interface is 3.0 where none is named.

    Raises InputError for a package or a version that there is not, and for a version without an FMU.
    """
    if name in _ABSENT:
        raise InputError("--for", f"{name}: {_ABSENT[name]}", _INSTEAD)
    check_choice("--for", name, PACKAGES)
    if name != "fmu":
        if fmi is not None:
            raise InputError("--fmi", "belongs to --for fmu", "add that, or leave it out")
        return Package(name)
    if fmi is not None and (isinstance(fmi, bool) or fmi not in FMI):
        raise InputError("--fmi", f"is {fmi!r}", "give 2 or 3")
    return Package(name, 3 if fmi is None else fmi)


def packed(files: Mapping[str, str | bytes], made: Made) -> dict[str, str | bytes]:
    """The plain ``files`` laid out as the ecosystem wants them, with what it adds.

    A README that it adds is a section of the folder's own.
    """
    added = _FILES[made.package](made)
    section = added.pop(README, "")
    laid = dict(files)
    if made.package == "arduino":
        laid[_ARDUINO_EXAMPLE] = laid.pop(_EXAMPLE)
    return {**laid, README: _text(laid[README]) + _text(section), **added}


def _text(content: str | bytes) -> str:
    """A README, which is always text."""
    return content if isinstance(content, str) else content.decode()


def moved(name: str) -> tuple[str, ...]:
    """Where else the plain file ``name`` may stand in a package."""
    return (_ARDUINO_EXAMPLE,) if name == _EXAMPLE else (_EXAMPLE,) if name == _ARDUINO_EXAMPLE else ()


def package_file(path: str, name: str) -> bool:
    """Whether ``path`` is one that a package of the controller ``name`` has, in whatever ecosystem."""
    return path in (known.replace("NAME", name) for known in _NAMES)


_NAMES = """
    CMakeLists.txt LICENSE library.properties keywords.txt src/NAME.h src/NAME.c src/NAME_selftest.h
    src/NAME_selftest.c examples/NAME/NAME.ino library.json examples/NAME/NAME.c fmu/modelDescription.xml
    fmu/buildDescription.xml fmu/NAME_fmi2.c fmu/NAME_fmi3.c extras/example/main.c
""".split()
