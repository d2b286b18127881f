"""What is believed of a rig once the fits are made: one posterior over sets of effects.

:mod:`~focgen.diagnosis.belief.likelihood` is the model; the other files are the questions put to it.
"""
