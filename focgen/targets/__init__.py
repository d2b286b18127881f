"""Generated C on emulated microcontrollers: compilers, cores, timing, stack."""
