"""Pure mathematics of fractional order: transfer functions, weights, exact responses, simulators."""

from focgen.fractional.responses import mittag_leffler, ramp_response, step_response
from focgen.fractional.simulation import Convolution, GrunwaldLetnikov, Simulator, gl_operator
from focgen.fractional.transfer import Term, TransferFunction
from focgen.fractional.weights import (
    gl_weights,
    gl_weights_at,
    short_memory_bias,
    short_memory_bias_asymptote,
)

__all__ = [
    "Convolution",
    "GrunwaldLetnikov",
    "Simulator",
    "Term",
    "TransferFunction",
    "gl_operator",
    "gl_weights",
    "gl_weights_at",
    "mittag_leffler",
    "ramp_response",
    "short_memory_bias",
    "short_memory_bias_asymptote",
    "step_response",
]
