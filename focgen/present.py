"""Parts that a thing may lack, where the caller knows that it has them."""

from __future__ import annotations

from typing import TypeVar

T = TypeVar("T")


def present(part: T | None) -> T:
    """``part``, which is there. Raises ValueError where it is not, which is a fault of the caller."""
    if part is None:
        raise ValueError("a part that was taken to be there is not")
    return part
