"""Pure mathematics of fractional order: transfer functions, weights, exact responses, simulators."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from focgen.fractional.convert import (
        bode,
        from_control,
        from_scipy,
        nyquist,
        to_control,
        to_frd,
        to_scipy,
    )
    from focgen.fractional.discrete import (
        UnprovenStability,
        UnstableRecursion,
        gl_frequency_response,
        inverse_l1_bound,
        poles_outside,
        shortest_stable_length,
    )
    from focgen.fractional.exponential import ExponentialMemory, fit_exponential, fit_states
    from focgen.fractional.exponential_rounded import fit_rounded
    from focgen.fractional.responses import mittag_leffler, ramp_response, step_response
    from focgen.fractional.simulation import Convolution, GrunwaldLetnikov, Simulator, gl_operator
    from focgen.fractional.transfer import Term, TransferFunction
    from focgen.fractional.weights import (
        gl_weights,
        gl_weights_at,
        short_memory_bias,
        short_memory_bias_asymptote,
    )

# Where each public name lives; imported on first use, since scipy takes its time.
_NAMES = {
    "Convolution": "simulation",
    "ExponentialMemory": "exponential",
    "GrunwaldLetnikov": "simulation",
    "Simulator": "simulation",
    "Term": "transfer",
    "TransferFunction": "transfer",
    "UnprovenStability": "discrete",
    "UnstableRecursion": "discrete",
    "bode": "convert",
    "fit_exponential": "exponential",
    "fit_rounded": "exponential_rounded",
    "fit_states": "exponential",
    "from_control": "convert",
    "from_scipy": "convert",
    "gl_frequency_response": "discrete",
    "gl_operator": "simulation",
    "gl_weights": "weights",
    "gl_weights_at": "weights",
    "inverse_l1_bound": "discrete",
    "mittag_leffler": "responses",
    "nyquist": "convert",
    "poles_outside": "discrete",
    "ramp_response": "responses",
    "short_memory_bias": "weights",
    "short_memory_bias_asymptote": "weights",
    "shortest_stable_length": "discrete",
    "step_response": "responses",
    "to_control": "convert",
    "to_frd": "convert",
    "to_scipy": "convert",
}

__all__ = [
    "Convolution",
    "ExponentialMemory",
    "GrunwaldLetnikov",
    "Simulator",
    "Term",
    "TransferFunction",
    "UnprovenStability",
    "UnstableRecursion",
    "bode",
    "fit_exponential",
    "fit_rounded",
    "fit_states",
    "from_control",
    "from_scipy",
    "gl_frequency_response",
    "gl_operator",
    "gl_weights",
    "gl_weights_at",
    "inverse_l1_bound",
    "mittag_leffler",
    "nyquist",
    "poles_outside",
    "ramp_response",
    "short_memory_bias",
    "short_memory_bias_asymptote",
    "shortest_stable_length",
    "step_response",
    "to_control",
    "to_frd",
    "to_scipy",
]

if not TYPE_CHECKING:  # a checker reads the imports above

    def __getattr__(name: str) -> Any:
        if name not in _NAMES:
            raise AttributeError(f"module 'focgen.fractional' has no attribute {name!r}")
        return getattr(import_module(f"focgen.fractional.{_NAMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
