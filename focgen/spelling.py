"""Old spellings of a call: taken as the new ones, with a warning that names those."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, ParamSpec, TypeVar, cast

P = ParamSpec("P")
R = TypeVar("R")
Call = tuple[tuple[Any, ...], dict[str, Any]]
Order = Callable[[tuple[Any, ...], dict[str, Any]], Call | None]


def respelled(
    names: Mapping[str, str], order: Order | None = None, now: str = ""
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A function that takes its keyword arguments by their old ``names`` (old → new), too.

    ``order`` returns positional and keyword arguments in the new order where they came in the old one, else
    None; ``now`` is the order to use. Each old spelling causes a DeprecationWarning at the caller's line.
    Raises TypeError where an argument is given by both names.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        call_it, called = cast(Callable[..., R], function), function.__name__

        @wraps(function)
        def call(*args: Any, **kwargs: Any) -> R:
            for old in [name for name in kwargs if name in names]:
                new = names[old]
                if new in kwargs:
                    raise TypeError(f"{called}() got both {old!r} and {new!r}, which are the same argument")
                kwargs[new] = kwargs.pop(old)
                warnings.warn(f"{called}({old}=…) is now {called}({new}=…)", DeprecationWarning, 2)
            turned = order and order(args, kwargs)
            if turned:
                args, kwargs = turned
                warnings.warn(f"the order is now {called}{now}", DeprecationWarning, 2)
            return call_it(*args, **kwargs)

        return cast(Callable[P, R], call)

    return decorate
