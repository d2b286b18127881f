"""Generated C in a loop with a simulated rig under faults: ``make trust``."""
