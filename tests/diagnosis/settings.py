"""Numbers of the diagnosis that stand outside :mod:`focgen.diagnosis.numbers`, by file.

None decides whether an effect is there, which one, or how sure that is. They are settings of fits, searches
and experiments, priors of nuisances, what a path through the session has to show, the widths of the promise,
and the checks of a running controller.
"""

CONSTANTS = {
    "belief/standing.py": ["_SAME", "_SURE"],
    "controller/quantisation.py": ["_DECIMAL", "_DIGITS", "_OFF", "_SAME"],
    "controller/replayed.py": ["_SLOWER"],
    "belief/choice.py": ["NEAR", "_BEHIND"],
    "controller/check.py": ["_LARGE", "_NEARLY", "_RESOLVED", "_ROUNDED", "_STEADY", "_TIED"],
    "controller/stamps.py": ["LOST", "UNSTEADY", "_FOLLOWING"],
    "fitting/fit.py": ["FIXED", "STEP", "_HOPELESS", "_LAGGING", "_NOTHING", "_SURE"],
    "fitting/jumps.py": ["_ABOUT", "_FINEST", "_STEP", "_WORTH"],
    "fitting/pinned.py": ["_EITHER_WAY"],
    "fitting/predictability.py": ["_DAMPING", "_PERIODS", "_QUIETEST", "_RIDGES", "_SAMPLES"],
    "fitting/realign.py": ["_TAKEN"],
    "fitting/repeats.py": ["_ALIKE", "_AS_WELL", "_CELL", "_CLOSES", "_LATER", "_MOVED", "_ONE_SENSE"],
    "hypotheses/blurred.py": ["_SPIKE", "_STAYS"],
    "hypotheses/bootstrap.py": ["_RARE"],
    "hypotheses/input_covariance.py": ["_FLAT"],
    "hypotheses/converter.py": ["_EASED"],
    "hypotheses/disturbance.py": ["SLOWEST"],
    "hypotheses/explain.py": ["_BELIEVED"],
    "hypotheses/initial.py": [
        "_APART",
        "_EXACT",
        "_HELD",
        "_LEVEL",
        "_LITTLE",
        "_QUIET",
        "_RESOLVED",
        "_REST",
        "_SEEN",
        "_SHOWN",
        "_SURE",
    ],
    "hypotheses/left.py": ["_ERRORS", "_OFF", "_STILL"],
    "hypotheses/level_pace.py": ["_PART"],
    "hypotheses/longer_path.py": ["_HELD", "_KEPT"],
    "hypotheses/nuisances.py": ["_AHEAD", "_GAUGE", "_HALF", "_OUT_OF_STEP", "_SMOOTHER", "_STEP"],
    "hypotheses/roughly.py": ["_NEAR"],
    "hypotheses/search.py": ["_ADRIFT", "_BENT", "_FAR", "_NEAR", "_QUICK"],
    "hypotheses/seen_through.py": ["_FINELY"],
    "hypotheses/uneven_pace.py": ["_CURVE", "_RATE"],
    "problem/decimate.py": ["_WITHIN"],
    "problem/excitation.py": ["_STEADY"],
    "problem/factors.py": ["LEAST", "WITHIN"],
    "problem/free.py": ["_SLACK", "_USUAL"],
    "problem/problem.py": ["ZERO", "_BASELINE", "_BEGUN", "_FAR_OFF", "_OFF", "_QUICKEST", "_STANDS"],
    "problem/segments.py": ["_EITHER", "_FOLLOWED", "_TIMING"],
    "problem/smooth.py": ["_SLOW"],
    "proposals/candidate_rigs.py": ["_STEP"],
    "proposals/menu.py": ["_SHORTEST"],
    "proposals/next_experiment.py": ["_CERTAIN", "_ENOUGH", "_MOST", "_SHARES", "_SURE"],
    "proposals/separation.py": ["_NOISIER"],
    "proposals/identifiability.py": ["ALIKE", "HIDDEN", "_COMMAND", "_FINE", "_LONGEST"],
    "proposals/limits.py": ["_BELOW", "_BEYOND", "_JUMP", "_LEAST", "_LONGEST", "_MARGIN"],
    "verdict/clocks.py": ["_SETTLED"],
    "verdict/compose.py": ["_SHOWN"],
    "verdict/evidence.py": ["_STILL"],
    "verdict/moves.py": ["_SLACK"],
    "verdict/on_the_bench.py": ["_FORMS", "_NUDGE", "_PLAIN", "_SAMPLE"],
    "verdict/moving.py": ["_MOST", "_SEEN", "_SURE"],
    "verdict/sizes.py": ["_SLACK"],
    "verdict/outside.py": ["_ASKED", "_BAND"],
    "verdict/restless.py": ["_MOVES", "_RESTS", "_STILL", "_SURE"],
    "verdict/taken_up.py": ["_SETTLED"],
    "verdict/pieces.py": ["_PARTS"],
    "verdict/unsteady.py": ["_CHANCE", "_NOTHING"],
    "verdict/improvement.py": [
        "_AHEAD",
        "_FITTED",
        "_FORM",
        "_LOST",
        "_LOST_IN_DOUBT",
        "_LOUD",
        "_MOST",
        "_REST",
    ],
    "verdict/cautions.py": ["_NEAR"],
}

COMPARED = {
    "controller/check.py": [0.0001, 0.002],  # of the range, of the command: limits and departures
    "hypotheses/converter.py": [12.0],  # a step squared over 12 is what a rounding leaves
    "hypotheses/disturbance.py": [0.1, 8.0],  # ends of bands of frequency
    "problem/decimate.py": [3.0],  # samples
    "proposals/menu.py": [10.0],  # response times of a hold
    "verdict/evidence.py": [0.002],  # of the largest rate, drawn
    "verdict/improvement.py": [1.0001],  # nothing can shrink
    "verdict/conclude.py": [1.01, 0.02],  # visibly; a share worth telling
}
