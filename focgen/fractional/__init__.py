"""Pure mathematics of fractional order: transfer functions, weights, exact responses, simulators."""
