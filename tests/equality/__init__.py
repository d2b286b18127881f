"""Generated C and the reference, sample for sample, over very many random controllers."""
