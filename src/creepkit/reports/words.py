"""What results say: every sentence of headlines, cautions, next steps, verdicts and remarks.

Whoever words a result edits these texts, no code. A sentence has 25 words at most, no full stop. Braces hold what the
result puts in, after a colon how it is written (wording.FORMATS); what stands between < and > is left out without it.
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
    # the p-value is 0.3 % or more, by a nuisance three standard deviations from what was stated
    "implausible": "only {article} {one.kind} of {amount} keeps the tests from rejecting it",
    # without
    "explains": "the tests do not reject it",
    # what it misses lies in single tests, or in two groups of them (their sentence follows)
    "in tests": "{cause}",
    # any other misfit beyond the noise; why stands in the first caution
    "rejected": "the tests reject it as exact",
}
"""{kind: whether the law could be the true one}, at the end of a headline."""

CAUTIONS = {
    # tests at several temperatures, and a law that has none
    "no temperature": "the tests are at {low:C} to {high:C}, and the law knows no temperature",
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
    # an interval as wide as said there ends at a bound; or lies between its bounds
    "not determined": "{by} do not determine {names}<, and hardly {others}>",
    # intervals so wide lie between their bounds
    "hardly determined": "{by} hardly determine {others}",
    # leaving it out moves the exponent by more than 15 %
    "one test": "without test {test} the stress exponent is {change} {side}",
    # offsets or drifts would move rates
    "not included": "intervals leave out {kinds}<, another in {each}>: the law's rate moves by {change}<, that of "
    "one test by {alone}>",
    # the checks of readings flag some
    "suspect": "readings of {tests} are suspect; nothing was dropped",
}
"""{kind: a caution}, the most serious first."""

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
    # groups of tests differ that their labels tell apart
    "check stated groups": 'identify each {key} apart (group_by = "{key}" in a study, or --only "{key}={value}")',
    # nothing tells them apart
    "check groups": "look how {one.tests:two} differ (material, heat, rig), then identify each group apart",
    # a test disagrees with all others
    "check one test": "check test '{one.tests[0]}' again (label, unit, thermocouple), then identify without",
    # several do
    "check tests": "check tests {one.tests:quoted} again (label, unit, thermocouple), then identify without",
    # one does, too little for a verdict, and a few kelvin would do it
    "check temperature": "check the temperature of {one.tests[0]}",
    # nothing so simple would
    "check record": "check the record of {one.tests[0]}",
    # tests are at several temperatures, and the law has none
    "temperature": "give the law a temperature: ck.with_arrhenius(law, tests)",
    # the search did not converge
    "search": "repeat the search with more starts (--starts {starts}, or starts in a study)< and bounds for {names}>",
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
    "separate": "test at {stress} MPa, {celsius}, for {hours} h: {first} and {second} differ {factor:.2g} times there",
    # bars cannot
    "separate otherwise": "make a test that tells {first} from {second} (creepkit design)",
    # the law above a threshold stress explains the tests as well, and bars can tell
    "threshold": "test at {stress} MPa, {celsius}, for {hours} h, which tells whether there is a threshold",
    # bars cannot
    "threshold otherwise": "test at a lower stress, which tells whether there is a threshold (creepkit design)",
    # what nobody measured would take the weight from the best law
    "measure": "measure the {second} of the tests: one that nobody modelled would make another law the better",
    # what nobody modelled, of usual size, takes the rejection away; or the true stress held in place of the load
    "remedy": "check for {remedy}: the law would then explain the tests",
    # parameters are not determined, and a bar would do it
    "determine": "to determine {names}, test at {stress} MPa, {celsius}, for {hours} h: the rate is known least there",
    # a bar would not
    "determine otherwise": "make a test that determines {names} (creepkit design)",
    # none of these; bars may narrow intervals
    "use": "forecast (creepkit predict), or export the law to your code (creepkit export)<; to narrow intervals, test "
    "at {stress} MPa, {celsius}, for {hours} h: a factor of {factor:.2g} there>",
}
"""{kind: what to do now}."""

BRACKETS = "In brackets: 95 % intervals, of one new test where it says so."
"""Below the numbers of an answer."""

NEW_TEST = "{condition}, one new test"
"""Where a number holds whose interval has the scatter between tests in it."""

OVER_ALL_TESTS, MEAN_SLOPE = "over all tests", "slope of the measured rates: {value}"
"""Where a stress exponent or activation energy is that of the measured rates; and beside the law's at one condition."""

BY_REJECTED = "by the law, which the tests reject"
"""Beside those of a law where the tests show none of their own."""

MEAN_SLOPES = "slope of all rates: measured {measured}, law {predicted}"
"""Above the picture of minimum rates."""

OTHER_N = "; n is a parameter, not the stress exponent"
"""Beside the values of a law in which they differ."""

CODES = "In {codes} (creepkit export)"
"""Beside the files: the law's keyword, or the routine that it needs, in finite element codes."""

ALL_DIGITS = "all digits{more}: details"
"""Behind the values of a law, which have four there."""

CONSTANT_LOAD = "a constant load lets the true stress rise, by up to {growth}: the interval rests on the law's form too"
"""Beside the exponent of such tests."""

COMPARED = {
    # a law with a smaller misfit than the best, and why it is behind
    "readings": "{law} has the smaller misfit of {what}, but its chi-square over all readings is {more} higher",
    # its chi-square is not higher
    "parameters": "{law} has the smaller misfit of {what}, but its parameters cost more ({excess} behind)",
    # nobody asked for it
    "left out": "{law} has the smaller misfit of {what}, but was not asked for and predicts left-out tests worse",
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
    "misses": "the law misses the rate of the nearest tests ({at}) by a factor of {factor}"
    "<; intervals allow for {here} here>",
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

PLATE = {
    # always
    "headline": "best law: {first} in {count} of {materials}<, {others:commas}>, for {range}<; "
    "in {rejecting} the tests reject it>",
    # of some
    "failed": "of {failed} more no law was identified",
    # the search did not converge
    "not converged": "of {names} the search did not end: these values may not be the best",
    # not all choices are
    "choice": "the choice of the law is decisive in {decisive} of {choices}",
    # some searches did not
    "next search": "repeat the search of these with more starts (--starts, or starts in a study)",
    # the tests reject most
    "next laws": "compare further laws (creepkit list laws): the tests reject those of most materials",
    # neither
    "next use": "use each law within its tests; what to do next of each stands with it",
}
"""{kind: what the laws of several materials say first}, cautions and what to do next."""

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

CAUSES = {
    # one test disagrees with all others
    "one test": "test '{one.tests[0]}' does not agree with the others",
    # several do
    "tests": "tests {one.tests:quoted} do not agree with the others",
    # two groups of tests do, which nothing tells apart
    "groups": "tests are of two groups: {one.tests:two} creep {factor:.2g} times as fast",
    # two groups that labels of the tests tell apart, the faster first
    "stated groups": "{first} creeps {factor:.2g} times as fast as {other}",
    # curves and rates of tests disagree on the exponent
    "curves": "the law's {one.kind} is {low:.2g} by the shape of the curves and {high:.2g} by the rates of the tests",
    # curves and lives of tests disagree on how lives depend on stress
    "life exponent": "lives of the tests fall {faster} with stress than the law's, by a power of {size:.2g}",
    # it changes more than the law lets it
    "stress exponent": "the stress exponent {rises} from {low:.2g} at {start:.4g} MPa to {high:.2g} at {end:.4g} MPa",
    # so does the energy
    "activation energy": "the activation energy {rises} from {low:kJ/mol} at {start:C} to {high:kJ/mol} at {end:C}",
}
"""{kind: why tests reject a law, or which of them do}, in a headline."""

CAUSES_AT_LENGTH = {
    # as above
    "one test": "test '{one.tests[0]}' ({one.condition}) creeps {factor:.3g} times as fast as the others say"
    "< (or '{near}' is to blame)><; it would agree with them {errors}><; without it {without}>",
    # as above
    "tests": "tests {one.tests:quoted} creep {one.factors:factors} times as fast as others say<; without it {without}>",
    # as above
    "groups": "tests ({one.tests:six}) creep {factor:.3g} times as fast as the others at equal conditions: "
    "are they of one material?",
    # as above
    "stated groups": "{cause} at equal conditions ({one.label}: {one.tests:six})",
    # the exponent or the energy
    "changes": "{cause}, more than this law lets it",
    # any, with the next likely one
    "beside": "{cause}; less likely by {odds:odds}: {other}",
    # where that is about as likely
    "as likely": "{cause}; about as likely: {other}",
}
"""{kind: the same with its numbers}, where a verdict is given at length."""

CAUSE_CAUTIONS = {
    # one test
    "one test": "{one.tests[0]} creeps {sizes} times as fast as the others lead to expect<; {kelvin} would do it>",
    # several
    "tests": "{one.tests:and} creep {sizes} times as fast as the others lead to expect<; {kelvin} would do it>",
    # any other, of odds that are no verdict
    "others": "{cause}: {odds:.2g} times likelier than scatter, too little for a verdict",
}
"""{kind: the same as a caution}."""

ERRORS = {
    # of strain, load or time by a factor
    "factor": "if its {quantity} were {factor:.3g} times {smaller}< (nearly {unit:g}: a unit?)>",
    # of a few kelvin
    "temperature": "at {actual:C}, {kelvin}",
    # as it says
    "kelvin": "{kelvin:.2g} K {less} than stated",
    # of up to 30 %
    "load": "at a load {change:%} {lower}",
}
"""{kind: with which error of what is stated a test would agree}."""

VERDICTS = {
    # a simulation ends before a reading
    "unpredicted": "cannot be judged: it does not predict every reading of test {found.unpredicted:first}",
    # the noise is not known
    "not judged": "cannot be judged: {why}",
    # the p-value is 0.3 % or more
    "explains": "is not rejected by the tests at their {sources:and} noise<{qualified}>"
    "< (rates of tests scatter by {scatter})><{doubt}>: {chi_square}, {p}<{slow}>",
    # minimum rates and rupture times contradict one another, and there are no curves
    "values": "is rejected by the tests: {contradiction}",
    # rates of tests alone reject it
    "rates": "is rejected by the rates of the tests: {cause}<; curves agree with the noise ({curves})>",
    # any other
    "leaves": "leaves {parts} unexplained: {chi_square}, {p}<. Most in {largest}>"
    "<. It would explain them with {remedies:or with}, which nobody modelled><; {cause}>",
}
"""{kind: the verdict at length}, behind "the law" or "it"."""

OF_VERDICTS = {
    # of each output that is missed
    "part": "{amount} of {one.output} ({one.discrepancy_in_noises:noises} times its {one.noise_source} noise)",
    # of rates of tests
    "scatter": "rates of tests that scatter by a factor of {factor:.2g}",
    # none of these
    "noise": "more than noise",
    # where it misses most
    "largest": "{one.output} of '{one.test}'< (rms {rms})> about {one.time:h}, where it lies {amount} {above} what was "
    "measured",
    # nuisances are implausible
    "qualified": ", but only with {nuisance}< (and {more} more such nuisances)>",
    # chi-square is far below one
    "doubt": " (far larger than what the readings show: check its unit)",
    # what is left is autocorrelated
    "slow": "; what is left is autocorrelated, noise or the law's own",
    # a cause of rates beside curves that are missed
    "rates": "of its rates, {cause}",
    # chi-square, everywhere; what is expected where noise is estimated from few readings
    "chi-square": "reduced chi-square {found.chi_square:.3g} with {found.freedom:.0f} degrees of freedom"
    "<, critical value {found.critical_chi_square:.3g}><, expected {expected:.3g} as noise is estimated>",
    # of several outputs
    "adjusted": "<smallest {found.smallest_p_value:p}, >{p} adjusted for {count} comparisons (Bonferroni)",
    # minimum rates and rupture times
    "contradiction": "minimum creep rates and rupture times contradict one another by this law: predicted over "
    "measured is {one.rate_ratio:.2g} of minimum rates and {one.time_ratio:.2g} of rupture times in the mean<{trend}> "
    "({one.tests} tests that scatter by a factor of {one.scatter:.3g}, {one.p_value:p})",
    # their products are one in the mean
    "trend": ", and their ratio changes with stress or temperature",
}
"""{kind: a part of a verdict}."""

SHORT_VERDICTS = {
    # the p-value is 0.3 % or more
    "explains": "not rejected ({found.p_value:p})<, but only with a large {nuisance}>",
    # as it says
    "values": "rejected: rates contradict rupture times",
    # what it misses has one cause
    "cause": "rejected: {cause}",
    # it misses readings
    "leaves": "rejected: off by {found.discrepancy_in_noises:noises} times the noise",
    # it misses none
    "rates": "rejected: rates of tests are not followed",
}
"""{kind: the verdict in few words}, in tables."""

NOISE_UNKNOWN = {
    # of curves
    "frames": "no noise is stated, and too few readings< of {tests}> show it: noise that is estimated from fewer than "
    "{fewest:.0f} readings of a test cannot judge whether a law explains it; state it in a column such as {column}_sd, "
    "in Python as standard_deviation",
    # of minimum rates
    "rates": "no noise of the minimum rates is stated, and scatter between tests was estimated from them. State it in "
    "a column such as minimum_rate_sd_1/s, in Python as minimum_rate_sd",
    # of rupture times alone
    "ruptures": "rupture times alone show no noise beside the scatter between tests, which was estimated from them",
}
"""{kind: why nothing is known of the noise, and where to state it}."""

CHOICES = {
    # all conditions are met
    "decisive": "decisive: {best}, of {count} laws tried; {verdict}<; {same}><; but {allowed:but}>",
    # one law was fitted
    "alone": "{alone}; {verdict}<; {same}>",
    # any other
    "not decisive": "not decisive: {reason}<; {same}>",
    # what the best law misses lies in tests
    "in tests": "of {count} laws tried {best} is best ({weight}), but {cause}: {explanation}",
    # the best law is rejected
    "none": "none of {count} laws tried explains the tests< as they are stated; {refuted:and}>. The best is {best} "
    "({weight}<, not told apart from {others:and}><; with {remedies:or}, which nobody modelled, {remedied} would "
    "explain them>); {verdict}",
    # a law that nobody asked for is not
    "asked": "{none} the tests<; with {remedies:or}, which nobody modelled, {remedied} would explain them>; of "
    "{further} more that were tried, {best} is not rejected by them ({weight}): plan tests that can refute it",
    # of several that were asked for
    "none asked": "none of the {asked} laws asked for explains",
    # of one
    "one asked": "the law asked for does not explain",
    # several have weight
    "apart": "of {count} laws tried these tests cannot tell apart {names:and}; <{refuted:and}; >the best is {best}: "
    "{verdict}<; {lost}>",
    # one has, and is challenged
    "challenged": "of {count} laws tried {best} has nearly all the weight ({weight}); it is not rejected by the tests"
    "<{qualified}>; but {refuted:and}",
    # none of these
    "best": "of {count} laws tried {best} is best ({weight}); {verdict}<; {unmet}>",
    # the weight of the best
    "weight": "weight {weight:.2f} of the laws tried<; {lost}>",
    # another law is the same function
    "same": "{names:and} with its values is the same function over the tests",
    # several are
    "several same": "{names:and} with their values are the same function over the tests",
}
"""{kind: which law it is}, at length."""

UNMET = {
    # as it says
    "alternatives": "only {best} was fitted",
    # as it says
    "convergence": "the search for its values did not converge",
    # as it says
    "weight": "its weight is not above {decisive:g}",
    # it was tried beside those asked for
    "asked": "it is none of the laws asked for",
    # as it says
    "challenges": "what else the tests allow was not examined",
}
"""{condition of a decisive choice: that it is not met}."""

CHALLENGES = {
    # a usual error with which other laws explain the tests
    "remedy": "with {sizes:or with} {one.laws:or} would explain the tests< (weight {weight:.2f})>",
    # one that takes the weight from the best
    "effect": "{effect}, which was not modelled, would leave it a weight of {own:.2f} ({one.other}: {weight:.2f})",
    # it was not examined
    "unknown": "whether {altered} explains the tests as well could not be examined",
    # as it says
    "better": "{altered} fits better (its chi-square is {difference:.1f} {side})",
    # the chi-square is higher
    "higher": "{altered} is not excluded (its chi-square is {difference:.1f} {side})",
    # it is lower or the same
    "lower": "{altered} explains the tests as well (its chi-square is <{difference:.1f} >{side})",
    # what is altered: a share of another law
    "sum": "a share of {one.size:whole %} of the rate by {one.other}",
    # which was not examined
    "unknown sum": "a sum with {one.other}",
    # or a threshold
    "threshold": "{one.subject} of {one.size:.3g} MPa",
}
"""{kind: what the tests allow beside the best law}, behind "but"."""

SIZES = {
    # of a length, of each test
    "lengths": "independent errors of up to {size:.2g} % in the {what} of {where}",
    # the same of all
    "length": "a {what} {size:.2g} % {smaller}< in {each}>",
    # of temperature
    "drifts": "independent drifts of the temperature of up to {amount} over {where}",
    # as above
    "drift": "a drift of the temperature of {amount} over {where}",
    # of readings
    "offsets": "independent offsets of up to {amount} in the {what} of {where}",
    # as above
    "offset": "an offset of {amount} in the {what} of {where}",
}
"""{kind: a perturbation with the size that it takes}; plural where each test has its own."""

PERTURBATIONS = {
    # of temperature, of one test
    "drift": "a linear drift of {one.size:.2g} K over the test",
    # of several
    "drifts": "independent drifts of temperature, {one.size:.2g} K over each of {one.tests} tests",
    # of what is stated or read, of one test
    "error": "an {error} of {one.amount} in the {what} of the test",
    # of several
    "errors": "independent {error}s of {one.amount} in the {what} of each of {one.tests} tests",
    # how any moves the rate
    "moves": "by {change}<{deviation}> with {cause}< ({energy:%} a kelvin, {whence})>",
    # those that are not in intervals
    "not included": "the intervals do not include what would move the rate amid the tests: {effects}",
}
"""{kind: what nobody measured}, with what it does to the rate."""

REMARKS = {
    # of one start, or of all the same
    "one search": "the search ended once: whether another minimum is lower was not examined (raise starts)",
    # an interval ends at a bound of the search
    "cut": "the interval of {name} ends at its bound, {bound:.4g}, and not by the tests: intervals of rates and of "
    "the local exponent do not know this bound and may reach beyond it",
    # a reduced-order model was corrected
    "numerical": "at the optimum {one.predictor} differs from {one.refined} by {sizes} (rms); at most "
    "{one.noises:.2g} noises. This is corrected, and would have moved values by up to {one.shift:.2g} of their "
    "standard deviations<; {one.incomplete:commas} could not be corrected><{unsettled}>",
    # it has not settled
    "unsettled": "; a further correction may move them again",
    # a nuisance three standard deviations from what was stated
    "implausible": "the {one.kind}< of {one.output}> of '{one.owner}' is {amount}<, {share}>, "
    "{one.standard_deviations:.2g} times {expected} ({size}): it stands for more than its name says, look at the test "
    "or try another law",
    # such a one in another sentence
    "nuisance": "{article} {one.kind} of {amount} in <{one.output} of >'{one.owner}'<, {share}>",
    # what it was compared with: as stated
    "stated": "the standard deviation that was stated for it",
    # an offset
    "noise": "the noise of a frame",
    # any other
    "usual": "a usual {one.kind}",
    # its share of an output
    "of value": "{one.share:%} of its largest value",
    # of a length
    "of length": "{one.share:%} from its nominal length",
}
"""{kind: a remark on an identification}, beside its values."""
