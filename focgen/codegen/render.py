"""The Jinja environment of the templates: what a template asks for must be there."""

from __future__ import annotations

import dataclasses
from functools import cache

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from focgen.resources import shipped


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(shipped("templates")),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


def render(template: str, context) -> str:
    """Fill a template with the fields of a dataclass."""
    fields = {field.name: getattr(context, field.name) for field in dataclasses.fields(context)}
    return _environment().get_template(template).render(fields)
