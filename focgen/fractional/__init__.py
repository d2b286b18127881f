"""Pure mathematics of fractional order: transfer functions, weights, exact responses, simulators."""

from focgen.fractional.convert import from_control, from_scipy, to_control, to_scipy
from focgen.fractional.discrete import (
    UnprovenStability,
    UnstableRecursion,
    gl_frequency_response,
    inverse_l1_bound,
    poles_outside,
    shortest_stable_length,
)
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
    "UnprovenStability",
    "UnstableRecursion",
    "from_control",
    "from_scipy",
    "gl_frequency_response",
    "gl_operator",
    "gl_weights",
    "gl_weights_at",
    "inverse_l1_bound",
    "mittag_leffler",
    "poles_outside",
    "ramp_response",
    "short_memory_bias",
    "short_memory_bias_asymptote",
    "shortest_stable_length",
    "step_response",
    "to_control",
    "to_scipy",
]
