"""A PlatformIO library: ``library.json`` beside the plain files, which are built where they lie."""

from __future__ import annotations

import json

from focgen.codegen.packages.context import Made, build_context, licence, rendered


def platformio_files(made: Made) -> dict[str, str | bytes]:
    """library.json, the licence, and a section of the README."""
    context = build_context(made)
    described = {
        "name": context.name,
        "version": context.version,
        "description": f"The fractional-order controller {context.name}: generated C99 without dependencies.",
        "keywords": ["control", "fractional-order"],
        "license": "0BSD",
        "frameworks": "*",
        "platforms": "*",
        "headers": context.headers,
        "examples": [{"name": context.name, "base": "example", "files": ["main.c"]}],
        "build": {
            "srcDir": ".",
            "includeDir": ".",
            "srcFilter": ["-<*>", *(f"+<{source}>" for source in context.sources)],
            "flags": ["-ffp-contract=off"],
        },
    }
    return {
        "library.json": json.dumps(described, indent=2) + "\n",
        **rendered("platformio", context, ("README.md", "README.md.jinja")),
        "LICENSE": licence(),
    }
