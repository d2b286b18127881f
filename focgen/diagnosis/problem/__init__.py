"""What is asked of the logs: one stretch of the chain at a time, its nominal parameters, levels and clocks,
and what the experiments did to it.
"""
