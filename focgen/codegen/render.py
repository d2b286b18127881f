"""The Jinja environment of the templates: what a template asks for must be there."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from focgen.codegen.texts import comment, markdown, printf, string, xml
from focgen.resources import shipped

_WIDTH = 104


def broken(code: str, indent: int = 0) -> str:
    """One line of C, broken after a comma where it is too long; the rest stands below the first argument."""
    start = code.find("(") + 1
    lines, line = [], code
    while indent + len(line) > _WIDTH:
        cut = line.rfind(", ", start, _WIDTH - indent) + 1
        if cut == 0:
            break
        lines.append(line[:cut])
        line = " " * start + line[cut + 1 :]
    return ("\n" + " " * indent).join([*lines, line])


@cache
def _environment() -> Environment:
    made = Environment(
        loader=FileSystemLoader(shipped("templates")),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    filters = dict(comment=comment, string=string, printf=printf, markdown=markdown, xml=xml)
    made.filters.update(filters, broken=broken)
    return made


def render(template: str, context: Any) -> str:
    """Fill a template with the fields of ``context``, a dataclass of any kind."""
    fields = {field.name: getattr(context, field.name) for field in dataclasses.fields(context)}
    return _environment().get_template(template).render(fields)
