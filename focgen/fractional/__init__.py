"""Pure mathematics of fractional order: transfer functions, weights, exact responses, simulators."""

from focgen.fractional.transfer import Term, TransferFunction
from focgen.fractional.weights import (
    gl_weights,
    gl_weights_at,
    short_memory_bias,
    short_memory_bias_asymptote,
)

__all__ = [
    "Term",
    "TransferFunction",
    "gl_weights",
    "gl_weights_at",
    "short_memory_bias",
    "short_memory_bias_asymptote",
]
