"""What a result says first: every sentence of headlines, cautions and next steps.

Whoever words a result edits these texts and no code. A sentence has 25 words at most and no full stop; braces hold what
the result puts in.
"""

from __future__ import annotations

HEADLINES = {
    "use": "use {law} for {good}; {truth}",
    "use in part": "use {law} for {good}, not {bad}; {truth}",
    "between": "use {law} between the tests only, for {good}; {truth}",
    "between in part": "use {law} between the tests only, for {good}, not {bad}; {truth}",
    "use nothing": "do not use {law}: it misses {bad}; {truth}",
    "fitted": "{law} was fitted; {truth}",
    "not found": "do not use {law} yet: the search for its values did not converge{described}",
}
"""{kind: the first line of an answer}."""


TRUTHS = {
    "not judged": "whether it is true cannot be judged",
    "explains": "the tests do not contradict it",
    "explained": "{cause}",
    "two exponents": "by it minimum rates contradict rupture times",
    "shape": "curves differ in shape",
    "noise": "the tests differ from it by more than their noise",
}
"""{kind: whether the law could be the true one}, at the end of a headline."""


CAUTIONS = {
    "held": "{law} is held at {name} = {value}, the {end} bound of its search; to go on, write {wider}",
    "not converged": "the search did not end: these values may not be its best",
    "unknown": "whether the tests contradict the law is not known",
    "unpredicted": "it does not predict every reading of {tests}",
    "contradicting": "minimum rates and rupture times of the tests contradict one another by this law",
    "worst": "it is worst in {test}: {what} {amount} too {side} at {time}",
    "runs away": "it is worst in {test}: by the law it has broken by {time}",
    "remedy": "it would explain the tests with {remedy}, which nobody modelled",
    "implausible": "it takes {nuisance}, far from what was stated",
    "noise unknown": "the noise of readings is not known: the law cannot be judged",
    "undecided": "the tests cannot tell it apart from {laws}",
    "not determined": "{by} do not determine {names}",
    "hardly determined": "{by} hardly determine {names}",
    "one test": "without test {test} the stress exponent is {exponent}",
    "not included": "intervals do not include {kinds}: rates move by {change}",
    "suspect": "readings of {tests} are suspect; nothing was dropped",
}
"""{kind: a caution}, the most serious first."""


NEXT = {
    "search": "repeat the search with more starts (--starts {starts}, or starts in a study){bounds}",
    "law": "try {law} as well, for {why}",
    "laws": "compare it with other laws that suit the tests (creepkit init)",
    "search laws": "search laws that nobody wrote down (creepkit identify TESTS --search)",
    "within": "forecast between the tests only (creepkit predict): beyond them its misfit grows",
    "noise": "state the noise of the readings in a column {column}",
    "separate": "test at {stress} MPa, {celsius}, for {hours} h: {first} and {second} differ {factor} times there",
    "separate otherwise": "{first} and {second} need a test apart (creepkit design)",
    "threshold": "test at a lower stress, which tells whether there is a threshold (creepkit design)",
    "measure": "measure the {effect} of the tests: one that nobody modelled would make another law the better",
    "remedy": "find out whether there was {remedy}: the law would then explain the tests",
    "determine": "to determine {names}, test at {stress} MPa, {celsius}, for {hours} h: the rate is known least there",
    "determine otherwise": "make a test that determines {names} (creepkit design)",
    "use": "forecast (creepkit predict), or export the law to your code (creepkit export)",
}
"""{kind: what to do now}."""


BRACKETS = (
    "In brackets: 95 % intervals; those of forecasts and lives hold one new test. "
    "The mean misfit is over the tests that were fitted."
)
"""Below the numbers of an answer."""


RUPTURE = {
    "several": "use the mean of {names}: the tests cannot tell them apart",
    "decisive": "use {best}, which passes all checks",
    "single": "use {best}, which has nearly all the weight",
    "only": "use {best}, the only method that was fitted",
    "fails": "{best} fails: {check}",
    "extrapolated": "strengths at {hours} h are extrapolated: the longest test has {longest} h",
    "longer": "test to {hours} h: strengths beyond three times the longest test are extrapolated",
    "check": "look at the tests of the check that fails",
    "strengths": "use these strengths with their bounds",
}
"""{kind: what an assessment of rupture tests says first}, its first line, cautions and what to do next."""


TRY = {
    "exponent rises": "the stress exponent rises with stress",
    "exponent falls": "the stress exponent falls with stress",
    "early": "this one misses the beginning of the curves",
    "late": "this one misses the end of the curves",
}
"""{kind: why a law is to be tried}."""
