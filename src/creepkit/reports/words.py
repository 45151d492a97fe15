"""What a result says first: every sentence of headlines, cautions and next steps, and when it is said.

Whoever words a result edits these texts and no code; docs/reference/findings.md is made from them. A sentence has 25
words at most. Braces hold what the result puts in.
"""

from __future__ import annotations

from typing import NamedTuple


class Finding(NamedTuple):
    """when : it is said. text : the sentence, without a full stop."""

    when: str
    text: str


HEADLINES = {
    "use": Finding("it describes within a factor of two", "use {law} for {good}{where}; {truth}"),
    "use in part": Finding("one thing within a factor of two", "use {law} for {good}, not {bad}{where}; {truth}"),
    "use nothing": Finding("nothing within a factor of two", "do not use {law}: {bad} at best; {truth}"),
    "fitted": Finding("it is not known how well", "{law} was fitted; {truth}"),
    "not found": Finding(
        "the search did not converge", "do not use {law} yet: the search for its values did not converge{described}"
    ),
}
"""{kind: the first line of an answer}. where : the range of the tests."""


TRUTHS = {
    "not judged": Finding("no noise is known", "whether it is the true law cannot be judged"),
    "explains": Finding("chi-square is that of noise", "the tests do not contradict it"),
    "explained": Finding("one cause explains what is left of the rates", "but {cause}"),
    "two exponents": Finding("rates contradict lives", "but by it minimum rates contradict rupture times"),
    "shape": Finding("more than five noises of a curve are left", "but not for the shape of the curves"),
    "noise": Finding("less is left, and more than noise", "the tests differ from it by more than their noise"),
}
"""{kind: whether the law could be the true one}, at the end of a headline."""


CAUTIONS = {
    "held": Finding(
        "a value lies where its search ends",
        "{law} is held at {name} = {value}, the {end} bound of its search; to go on, write {wider}",
    ),
    "not converged": Finding("the search did not converge", "the search did not end: these values may not be its best"),
    "unknown": Finding("there is no verdict", "whether the tests contradict the law is not known"),
    "unpredicted": Finding("a test is not predicted to its end", "it does not predict every reading of {tests}"),
    "contradicting": Finding(
        "rates contradict lives", "minimum rates and rupture times of the tests contradict one another by this law"
    ),
    "worst": Finding("it misses the shape of curves", "it is worst in {test}: {what} {amount} too {side} at {time}"),
    "remedy": Finding("one error explains all", "it would explain the tests with {remedy}, which nobody modelled"),
    "implausible": Finding("a nuisance lies far from its prior", "it takes {nuisance}, far from what was stated"),
    "noise unknown": Finding("no noise is known", "the noise of readings is not known: the law cannot be judged"),
    "undecided": Finding("others have more than 5 % of the weight", "the tests cannot tell it apart from {laws}"),
    "not determined": Finding("intervals wider than a decade", "{by} do not determine {names}"),
    "hardly determined": Finding("intervals are wide", "{by} hardly determine {names}"),
    "one test": Finding("one test moves it by 15 %", "without test {test} the stress exponent is {exponent}"),
    "not included": Finding("errors common to all tests", "intervals do not include {kinds}: rates move by {change}"),
    "suspect": Finding("the data have flags", "readings of {tests} are suspect; nothing was dropped"),
}
"""{kind: a caution}, the most serious first."""


NEXT = {
    "search": Finding(
        "the search did not converge",
        "repeat the search with more starts (--starts {starts}, or starts in a study){bounds}",
    ),
    "law": Finding("a law not tried has what this one lacks", "try {law} as well, for {why}"),
    "laws": Finding("one law alone was fitted", "compare it with other laws that suit the tests (creepkit init)"),
    "within": Finding("no law tried explains the tests", "use it between the tests only: beyond them its misfit grows"),
    "noise": Finding("the law cannot be judged", "state the noise of the readings in a column {column}"),
    "separate": Finding(
        "a test would tell two laws apart",
        "test at {stress} MPa, {celsius}, for {hours} h: there {first} and {second} differ by a factor of {factor}",
    ),
    "separate otherwise": Finding("no such test is found", "{first} and {second} need a test apart (creepkit design)"),
    "determine": Finding(
        "a test would determine more",
        "to determine {names}, test at {stress} MPa, {celsius}, for {hours} h: the rate is known least there",
    ),
    "determine otherwise": Finding("no such test is found", "make a test that determines {names} (creepkit design)"),
    "use": Finding("nothing else", "forecast (creepkit predict), or export the law to your code (creepkit export)"),
}
"""{kind: what to do now}."""


TRY = {
    "exponent rises": Finding("exponent, high above low stress", "the stress exponent rises with stress"),
    "exponent falls": Finding("the reverse", "the stress exponent falls with stress"),
    "early": Finding("worst in the first half of a test", "this one misses the beginning of the curves"),
    "late": Finding("worst in the second half", "this one misses the end of the curves"),
}
"""{kind: why a law is to be tried}."""
