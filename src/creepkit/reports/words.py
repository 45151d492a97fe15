"""What a result says first: every sentence of headlines, cautions and next steps.

Whoever words a result edits these texts and no code. A sentence has 25 words at most and no full stop; braces hold what
the result puts in.
"""

from __future__ import annotations

HEADLINES = {
    # everything that was measured is predicted within a factor of 2
    "use": "use {law} for {range}: {within}; {truth}",
    # everything is, but the tests reject the law
    "use only": "use {law} for {range} only: {within}; {truth}",
    # some of it is, some is not
    "use in part": "use {law} in part, for {range}: {within}, but it misses {bad}",
    # nothing is
    "use nothing": "do not use {law}: on average it misses {bad}; {truth}",
    # nothing can be compared, as of fields alone
    "fitted": "{law} was fitted; {truth}",
    # the search did not converge
    "not found": "do not use {law} yet: the search for its values did not converge{described}",
}
"""{kind: the first line of an answer}; range : of the tests."""


ONE_TEST = "a new {level}'s {quantity} within a factor of {factor} (95 %)"
"""Behind the range of a law, of three tests or more; of fewer their mean misfit stands there."""


MEAN_MISFIT = "mean misfits: {misfits}"
"""Of the tests that were fitted, behind how many they are."""


FITS, MISSES = "{what} within {misfit}", "{what} by {misfit}"
"""What was measured, with the root mean square of predicted over measured in the fitted tests."""


TRUTHS = {
    # no noise is stated, and too few readings show it
    "not judged": "whether it is exact cannot be judged",
    # the p-value is 0.3 % or more
    "explains": "the tests do not reject it",
    # what it misses lies in single tests, or in two groups of them (their sentence follows)
    "in tests": "{cause}",
    # any other misfit beyond the noise; why stands in the first caution
    "rejected": "the tests reject it as exact",
}
"""{kind: whether the law could be the true one}, at the end of a headline."""


CAUTIONS = {
    # a value lies within 0.1 % of a bound of its search that is not physical
    "held": "{law} is held at {name} = {value}, the {end} bound of its search; to go on, write {wider}",
    # the search did not converge
    "not converged": "the search did not end: these values may not be its best",
    # an answer from a file says nothing of it
    "unknown": "whether the tests reject the law is not known",
    # they do; why follows, the first of REASONS that holds
    "rejected": "it is not exact: {reason}",
    # a simulation ends before a reading, or gives no number
    "unpredicted": "it does not predict every reading of {tests}",
    # a thickness, offset or drift of usual size takes the rejection away
    "remedy": "it would explain the tests with {remedy}, which nobody modelled",
    # a nuisance lies three standard deviations from what was stated
    "implausible": "it takes {nuisance}, far from what was stated",
    # it cannot be judged
    "noise unknown": "the noise of readings is not known: the law cannot be judged",
    # another law has a weight of 0.05 or more
    "undecided": "the tests cannot tell it apart from {laws}",
    # an interval as wide as said there ends at a bound
    "not determined": "{by} do not determine {names}",
    # one so wide lies between its bounds
    "hardly determined": "{by} hardly determine {names}",
    # leaving it out moves the exponent by more than 15 %
    "one test": "without test {test} the stress exponent is {change} {side}",
    # offsets or drifts would move rates
    "not included": "intervals leave out {kinds}: the law's rate moves by {change}{alone}",
    # the checks of readings flag some
    "suspect": "readings of {tests} are suspect; nothing was dropped",
}
"""{kind: a caution}, the most serious first."""


IN_EACH_TEST, ONE_ALONE = ", another in each test", ", that of one test by {change}"
"""Of several tests; and what it does to one by itself, where that is known."""


REASONS = {
    # a law of creep and rupture misses both, in opposite ways
    "two exponents": "by it minimum rates contradict rupture times",
    # rates reject it, and one cause explains them best (its sentence follows)
    "cause": "{cause}",
    # it misses curves, but not only by their rate: where its misfit is largest in noises
    "worst": "the {what} of {test} is {amount} too {side} at {time}",
    # the same, where its strain runs away before the test's
    "runs away": "by it {test} has broken by {time}",
    # any other
    "noise": "they differ from it by more than their noise",
}
"""{kind: why the tests reject a law}; of several the others are cautions of their own."""


NEXT = {
    # the search did not converge
    "search": "repeat the search with more starts (--starts {starts}, or starts in a study){bounds}",
    # the law is rejected, and one that was not tried has what it lacks
    "law": "try {law} as well, for {why}",
    # it is rejected, and no other was tried
    "laws": "compare it with other laws that suit the tests (creepkit init)",
    # it is rejected, others were tried, and the tests are creep curves of bars
    "search laws": "search laws that nobody wrote down (creepkit identify TESTS --search)",
    # so it is, and they are not, or a search tried them
    "within": "forecast between the tests only (creepkit predict): beyond them its misfit grows",
    # it cannot be judged
    "noise": "state the noise of the readings in a column {column}",
    # laws have weights of 0.05 or more, and bars can tell them apart
    "separate": "test at {stress} MPa, {celsius}, for {hours} h: {first} and {second} differ {factor} times there",
    # bars cannot
    "separate otherwise": "make a test that tells {first} from {second} (creepkit design)",
    # the law above a threshold stress explains the tests as well, and bars can tell
    "threshold": "test at {stress} MPa, {celsius}, for {hours} h, which tells whether there is a threshold",
    # bars cannot
    "threshold otherwise": "test at a lower stress, which tells whether there is a threshold (creepkit design)",
    # what nobody measured would take the weight from the best law
    "measure": "measure the {effect} of the tests: one that nobody modelled would make another law the better",
    # what nobody modelled, of usual size, takes the rejection away; or the true stress held in place of the load
    "remedy": "find out whether there was {remedy}: the law would then explain the tests",
    # parameters are not determined, and a bar would do it
    "determine": "to determine {names}, test at {stress} MPa, {celsius}, for {hours} h: the rate is known least there",
    # a bar would not
    "determine otherwise": "make a test that determines {names} (creepkit design)",
    # none of these
    "use": "forecast (creepkit predict), or export the law to your code (creepkit export)",
    # behind that, of bars
    "narrow": "to narrow intervals, test at {stress} MPa, {celsius}, for {hours} h: a factor of {factor} there",
}
"""{kind: what to do now}."""


BRACKETS = "In brackets: 95 % intervals, of what one new test may show where this is said."
"""Below the numbers of an answer."""


NEW_TEST = "{condition}, one new test"
"""Where a number holds whose interval has the scatter between tests in it."""


OVER_ALL_TESTS, MEAN_SLOPE = "over all tests", "slope of the measured rates: {value}"
"""Where a stress exponent or activation energy is that of the measured rates; and beside the law's at one condition."""


MEAN_SLOPES = "slope of all rates: measured {measured}, law {predicted}"
"""Above the picture of minimum rates."""


OTHER_N = "; n is a parameter, not the stress exponent"
"""Beside the values of a law in which they differ."""


CODES, MORE_CODES = "In {codes}", "creepkit export, also for other codes"
"""Beside the files: the law's keyword, or the routine that it needs, in finite element codes."""


ALL_DIGITS = "all digits{more}: details"
"""Behind the values of a law, which have four there."""


CONSTANT_LOAD = (
    "under a constant load the true stress rises with strain, here by up to {growth}: "
    "the interval of the stress exponent rests on the form of the law too"
)
"""Beside the exponent of such tests."""


COMPARED = {
    # a law with a smaller misfit than the best, and why it is behind
    "readings": "{law} has the smaller misfit of {what}, but its chi-square over all readings is {more} higher",
    # its chi-square is not higher
    "parameters": "{law} has the smaller misfit of {what}, but its parameters cost more ({excess} behind)",
    # nobody asked for it
    "left out": "{law} has the smaller misfit of {what}, but nobody asked for it, and it predicts left-out tests worse",
    # it gives no number for some readings
    "unpredicted": "{law} has the smaller misfit of {what}, but does not predict every test",
    # below their table
    "chi-square": "laws are ranked by all readings under one covariance, not by mean misfits; verdicts by noise alone",
}
"""{kind: what is said of laws that were compared}."""


RUPTURE = {
    # weights of 0.05 or more
    "several": "use the mean of {names}: the tests cannot tell them apart",
    # weight of 0.95, and all checks pass
    "decisive": "use {best}, which passes all checks",
    # not all pass
    "single": "use {best}, which has nearly all the weight",
    # as it says
    "only": "use {best}, the only method that was fitted",
    # of each
    "fails": "{best} fails: {check}",
    # beyond three times the longest test
    "extrapolated": "strengths at {hours} h are extrapolated: the longest test has {longest} h",
    # so it is
    "longer": "test to {hours} h: strengths beyond three times the longest test are extrapolated",
    # one fails
    "check": "look at the tests of the check that fails",
    # neither
    "strengths": "use these strengths with their bounds",
}
"""{kind: what an assessment of rupture tests says first}, its first line, cautions and what to do next."""


FORECAST = {
    # one test
    "single": "{what} {value}; {trust}",
    # measured tests
    "measured": "{inside} of {judged} measured tests lie within their {level} bands and intervals; {trust}",
    # nothing can be predicted
    "none": "nothing is predicted of these tests",
    # in their ranges
    "within": "within the tests",
    # outside them
    "beyond": "extrapolated beyond the tests in {quantities}",
    # its end, where they reject the law
    "contradicted": ", by a law that the tests reject",
    # always
    "by": "by {laws}; in brackets {level} intervals of a single test, {right}",
    # its end, of one law
    "right": "if the law is right",
    # of several
    "one right": "if one of these laws is right, with these weights",
    # of a rejected one
    "wider": "wider by what the law misses",
    # of several tests
    "some beyond": "{count} of them extrapolated beyond the tests",
    # a caution
    "outside": "what was measured of {tests} lies outside its band or interval",
    # beside a time, where the law's curve reaches it at another
    "by values": "median of single tests; {hours} h by the law's values alone",
    # a caution, of a rejected law
    "misses": "the law misses the rate of the nearest tests by a factor of {factor}{allowed}",
    # its end, where that is more than nothing
    "allowed": "; intervals allow for {here} here",
    # one lies outside
    "next outside": "identify the law again with these tests (creepkit identify)",
    # it is extrapolated
    "next beyond": "make a test nearer to it (creepkit design)",
    # the law is rejected
    "next contradicted": "look for a law that the tests do not reject (creepkit identify TESTS --search)",
    # the largest part is none of the law's
    "next fixed": "plan with the interval: most of it is {part}, which no further test makes smaller",
    # none of these
    "next use": "plan with the interval, or narrow it by a further test (creepkit design)",
}
"""{kind: what a forecast says}, its first line and how far to trust it, by which laws, cautions, what to do next."""


DESIGN = {
    # one run
    "test": "next test: {test}; {told}",
    # several in the budget
    "plan": "make {count} runs: together {told}",
    # none with 0.2 or more
    "hopeless": "no test is likely to decide between the laws; the best, {test}, does with probability {probability}",
    # as it says
    "contradicted": "no test is proposed: the tests reject {law}, the best law",
    # as it says
    "one law": "no test is proposed: {law} remains alone, and nothing is to be told apart from it",
    # all are left out
    "none": "no test can be made within these limits: of {count} candidates {reasons}",
    # there are no candidates
    "nothing": "no test can be made: none lies within the loads, durations and temperatures that were stated",
    # the goal is the law
    "decides": "it decides between the laws with probability {probability}",
    # a quantity
    "narrows": "it brings the standard deviation of the {quantity} from {before} to {after}",
    # the parameters
    "shrinks": "intervals of the parameters become {factor} times as wide",
    # a sum or threshold remains beside it
    "from": "it tells {law} from {others}",
    # several remain
    "apart": "it tells {laws} apart",
    # its end, with sums or thresholds
    "and beside": ", and each from what the tests allow beside it",
    # a test is proposed
    "next make": "make it, then identify the law again with its file (creepkit identify)",
    # none is
    "next contradicted": "find a law that the tests do not reject, or design for the values (--goal parameters)",
    # none is
    "next one law": "design for the values, or for a rate or an exponent (--goal parameters, rate, exponent)",
    # none can be made, most would rupture
    "next would rupture": "allow lower loads, shorter or colder tests (--levels, --longest-h, --temperature-c)",
    # so they would
    "next would grow too far": "allow lower loads or shorter tests (--levels, --longest-h)",
    # their outputs stay within the noise
    "next would hardly grow": "allow higher loads, longer or hotter tests (--levels, --longest-h, --temperature-c)",
    # there are no candidates
    "next none": "state what the rig can do: loads, durations, temperatures (creepkit design --help)",
}
"""{kind: what a design of further tests says}, its first line, what it tells, and what to do next."""


TRY = {
    # rates say so
    "exponent rises": "the stress exponent rises with stress",
    # rates say so
    "exponent falls": "the stress exponent falls with stress",
    # its largest misfit lies in the first half of a test
    "early": "this one misses the beginning of the curves",
    # or in the second
    "late": "this one misses the end of the curves",
}
"""{kind: why a law is to be tried}."""
