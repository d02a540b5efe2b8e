"""Every number that decides what a diagnosis says: its value, its unit and where it comes from.

Where no source stands beside a number, it is a judgement.  Numbers that change only how long a diagnosis takes, or by
how little it is rounded, stand where they are used.  `experiments/settings_swept.py` multiplies and divides these by
1.5 and writes down what changes (docs/settings.md).
"""

import numpy as np

# --- Enough data: what can't be judged is said to be open ----------------------------------------------------------

# Low-passed rows of all recordings together; of one; and of one joint.  The library has some twenty laws of one to
# three amplitudes: fewer rows than that any of them fits, and what is left is no measure of noise.
FEWEST_ROWS, FEWEST_ROWS_OF_RECORDING, FEWEST_ROWS_OF_JOINT = 80, 16, 40
# [s] of motion that a joint must show: less is a few reversals, which any law fits.
FEWEST_SECONDS = 3.0
# Error of a joint as a share of its torque that may hide anything.
LARGE_ERROR = 0.5
# An error of more than so many times the sensors' scatter (three standard deviations) and more than this share of the
# joint's torque is no noise: the joint stays undecided where nothing is found.
ABOVE_NOISE, NOT_SMALL = 3.0, 0.1
# Blocks that a recording is cut into where motions can't be left out: five-fold cross-validation, as is usual
# (Hastie, Tibshirani, Friedman, The Elements of Statistical Learning, 2009, sec. 7.10).
BLOCKS = 5
# Share of a joint's rows, or of a finding's torque, that one motion holds: without it nothing is known there.
ALONE = 0.8
# [s] before what happens once, or after it, that must be recorded: longer than the low-pass spreads it.
EVENT_MARGIN = 0.2

# --- The instrument: prior standard deviations of what may be off by a little in any recording ---------------------

# Torque scale of all joints, and of each beside it.  Data sheets of servo motors state torque constants to +-10 %;
# that motors of one arm scatter by a third of it is a judgement.
GAIN_COMMON, GAIN_JOINT = 0.10, 0.03
# [s] between torque and position channels: a sample of a controller at 1 kHz, and half of one from joint to joint.  The
# latter is where the width of delays from joint to joint starts, which is not known (decision 30).
DELAY_COMMON, DELAY_JOINT = 1e-3, 5e-4
# [s^2] of the torque's second derivative: what smoothing takes off accelerations that noise hides.
SMOOTHED = 2e-5
# Of the stated armature: gear ratios are exact, rotors of data sheets are known to a tenth.  A judgement.
ROTOR_ERROR = 0.10
# [m] along each axis from where a known payload is said to sit: a body bolted to a flange by hand.  A judgement.
PAYLOAD_PLACED = 0.03
# Of a joint's torque: what differs by direction may go on through a reversal, or vanish there.
BIAS = 0.10

# --- The model discrepancy -----------------------------------------------------------------------------------------

# Sizes of a block, as shares of the joint's torque, over which the evidence is maximised: half-decades.
DISCREPANCY_SIZES = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3)
# Share of the torque that laws are usually wrong by: scale of the half-Cauchy prior of a size.  Careful identifications
# of industrial arms leave a few per cent.
USUAL_MISFIT = 0.03
# Of a joint's range, over which bristles turn round: of one radian, 0.2 to 12 mrad.
BRISTLE_TRAVELS = (2e-4, 8e-4, 3e-3, 1.2e-2)
# Of the top speed, over which friction nears its level.
ROUNDED_SPEEDS = (0.003, 0.01, 0.03, 0.1)
# [s] by which friction turns before or after the joint: samples and low-passes of controllers.
TURNING_DELAYS = (-0.01, -0.005, 0.005, 0.01, 0.02)

# --- The noise -----------------------------------------------------------------------------------------------------

# Share of the rows which must have all their lags for correlations to be known pair by pair.
ENOUGH_LAGS = 0.5
# Least share of a residual that is noise, where rows are unsure by more than that beside it.
LEAST_NOISE = 0.2
# Weight of every lag, of the row's own, below which noise is white: no row needs those before it.
NEGLIGIBLE_LAG = 0.1

# --- What is probable before anything is recorded ------------------------------------------------------------------

# Expected number of sites of a robot at which an effect that few machines have is left out.
RARE = 0.05
# Probability of ordinary friction at a joint.
COMMON = 0.5
# True over stated error of the inertials, in octaves: five of six statements are right within a factor of two, and
# some are far too small (decision 4).
WIDTH_OCTAVES = np.arange(-1.0, 6.0)
# Relative error of the inertials of a link that is wrong beyond its stated uncertainty: of another body altogether.
LOOSE_INERTIALS = 1.0
# Least mass of a link along any of its directions, of the nominal one there: thinner is rounding.
LEAST_MASS = 1e-3

# --- Naming --------------------------------------------------------------------------------------------------------

# Posterior probability, with that of what may stand in its place, from which an effect is named: odds of ten, "strong"
# evidence in Jeffreys, Theory of Probability, 1961, app. B.
NAMED = 0.9
# [nats] of odds of three, the root of those: "substantial" there.  Who has as much against it is not named.
SUBSTANTIAL = 0.5 * float(np.log(NAMED / (1.0 - NAMED)))
# [nats] of the best set, within which sets are averaged: others weigh less than one in a million.
WITHIN = 15.0
# Relative change of the noise from round to round below which shapes are fine enough.
SETTLED_NOISE = 0.1
# Standard deviation of a vector's component that moves nothing here, over the size of those that do: a direction taken
# at random has six times as much there in one case of ten (decision 19).
UNSEEN = 3.0
# [nats] by which refitted inertials must be more probable than the nominal ones: "decisive" in Jeffreys.
CLEARLY_BETTER = float(np.log(100.0))

# --- Structure that no effect explains -----------------------------------------------------------------------------

# Share of what is left that must be predictable, and share of the joint's torque: less is not worth a person's time,
# and smoothing and imperfect laws leave as much.
MATERIAL_SHARE, MATERIAL_TORQUE = 0.05, 0.02
# Most of what is left: share of its square that a short time or part of a range must hold to be told, and of what the
# best competitor predicts that a simpler one must reach.  And share of all recorded time or of a range that is short.
MOST_OF_ERROR, BRIEF = 0.8, 0.2
# Of what a joint travels, by which a stop at its end gives way.
STOP_GIVES = 0.01
# Share of time-shifted copies that may be as predictable.
SIGNIFICANT = 0.01
# Share of what time predicts that a competitor which knows the motion must reach to be named instead.
NEARLY = 2.0 / 3.0

# --- What a motion could have shown --------------------------------------------------------------------------------

# An effect of this share of the joint's torque along a lively motion should be seen with this many standard
# deviations, or the motion can't test it.  Five are the convention of particle physics for a discovery.
REFERENCE_SHARE, VISIBLE = 0.06, 5.0
# The lively motion: [s], share of the speed limits, seed.
LIVELY = {"duration": 10.0, "speed": 0.6, "seed": 1}
# Times the speed of rest from which sign(qd) is right to half a percent: tanh(3) = 0.995.
REST_ROUNDED = 3.0
# [s] over which the low-pass spreads what happens at a reversal.
LEAK = 0.1

# --- Worth a sentence ----------------------------------------------------------------------------------------------

# Least share of a finding's power at a joint that is listed, and of a joint's top speed in means by direction.
LISTED_POWER, SLOW = 0.05, 0.1
# Least probability of an alternative that is listed.
LISTED_PROBABILITY = 0.02
# [s] that commands come late.
NOTABLE_DELAY = 1e-3
# Of a joint's torque, by which corrected.xml differs from the corrected model.
NOTABLE_GAP = 0.03
# Standard deviations by which a link's inertials change.
NOTABLE_SHIFT = 3.0
# Links of which the summary says by how much their inertials are wrong; more are listed in one sentence.
FEW_LINKS = 2
# Times the noise of the torque sensors that the encoders' may be.
COARSE = 3.0

# --- The motion that decides ---------------------------------------------------------------------------------------

# Worth of making one effect testable, beside doubling the odds of a pair.
HIDDEN_WEIGHT = 0.3
# Times the speed seen in the recordings that a robot without speed limits is asked for at most.
SPEED_UP = 2.0
# Of the torque limits, that the nominal model may need: what is left out needs some, too.
EFFORT_SHARE = 0.8
# Noise of a joint that was not compared, of its torque on a lively motion: what current sensors of arms have.
UNKNOWN_NOISE = 0.01
