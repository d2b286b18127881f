"""Pure mathematics of fractional order: transfer functions, weights, exact responses, simulators."""

from importlib import import_module

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
    "poles_outside": "discrete",
    "ramp_response": "responses",
    "short_memory_bias": "weights",
    "short_memory_bias_asymptote": "weights",
    "shortest_stable_length": "discrete",
    "step_response": "responses",
    "to_control": "convert",
    "to_scipy": "convert",
}

__all__ = sorted(_NAMES)


def __getattr__(name: str):
    if name not in _NAMES:
        raise AttributeError(f"module 'focgen.fractional' has no attribute {name!r}")
    return getattr(import_module(f"focgen.fractional.{_NAMES[name]}"), name)


def __dir__():
    return __all__
