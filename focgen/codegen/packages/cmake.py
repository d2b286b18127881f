"""A CMake package: ``find_package(NAME)`` after an installation, or ``add_subdirectory``."""

from __future__ import annotations

from focgen.codegen.packages.context import Made, build_context, licence, rendered


def cmake_files(made: Made) -> dict[str, str | bytes]:
    """CMakeLists.txt, the licence that is installed, and a section of the README."""
    context = build_context(made)
    names = ("CMakeLists.txt", "CMakeLists.txt.jinja"), ("README.md", "README.md.jinja")
    return {**rendered("cmake", context, *names), "LICENSE": licence()}
