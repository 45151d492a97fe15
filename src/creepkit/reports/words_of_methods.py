"""Sentences of the methods text of a page, as those of creepkit.reports.words: who words a paper edits these alone."""

from __future__ import annotations

METHODS = {
    # published data have a citation
    "source": "the measured data are those of{sources}",
    # always
    "tests": "creep laws were identified from {tests}< of {materials}><: {fitted} of {readings} were fitted>",
    # of all outputs
    "compared": "compared were {outputs}",
    # rupture times among them
    "of ruptures": "rupture times by their logarithms",
    # minimum rates
    "of rates": "minimum creep rates by their logarithms",
    # strains
    "of logarithms": "{output} ε as arsinh(ε / 2f), a logarithm above f",
    # other outputs
    "of readings": "{outputs} over the standard deviation of a reading",
    # behind strains
    "floor": "the floor f is {share:%} of the median end value, at least {noises:g} noises",
    # curves go to rupture
    "to rupture": "readings to rupture, or of a rising rate, have orthogonal residuals √2 |a b| / √(a² + b²), signed "
    "as a. There a is predicted less measured transformed strain, b ln of the measured over the predicted time. Tests "
    "stopped before rupture count only where they lasted longer than predicted",
    # of bars
    "load": "loads were held, so that the true stress grows with strain",
    # of bars
    "stress": "true stresses were held",
    # of bars
    "with elastic": "strains are {measure} and contain the elastic strain on loading",
    # of bars
    "without elastic": "strains are {measure} and do not contain the elastic strain on loading",
    # elastic data are stated
    "elastic": "Young's modulus is {moduli} GPa and Poisson's ratio {ratios} in {tests}",
    # one was fitted
    "law": "the law was the {title}, Eq. ({number}){sources}",
    # several were
    "laws": "{count} laws were tried",
    # each of them
    "of laws": "Eq. ({number}) is the {title}{sources}",
    # laws have an activation energy
    "T_ref": "rate coefficients of laws with an activation energy are those at T_ref = {temperatures}",
    # by the specimen itself
    "model": "the tests were predicted by the model of the specimen '{name}'",
    # or not
    "surrogate": "the tests were predicted by a surrogate of the specimen '{name}'",
    # of finite elements
    "reduced order": "the global search used the reduced-order model of these finite elements",
    # always
    "region": "parameters were sought within the bounds of the table of symbols by least squares in a trust region"
    "{cite[trust region]}",
    # a search was made
    "starts": "up to {starts} were picked out of at most {points} points of a Sobol' sequence{cite[sobol]} (seed "
    "{seed})",
    # weights "equal"
    "equal weights": "values were found by least squares of readings of equal weight",
    # always
    "noise": "white and autocorrelated noise, offsets and the scatter of rates were estimated by restricted maximum "
    "likelihood{cite[reml]}",
    # weights "likelihood"
    "likelihood": "95 % intervals follow from the whole covariance with Satterthwaite's degrees of freedom"
    "{cite[satterthwaite]}. Parameters have weak Gaussian priors, with the variance of a uniform distribution between "
    "their bounds",
    # other weights
    "weighted": "95 % intervals follow from the covariance of this weighted estimate{cite[weighted least squares]}, "
    "H⁻¹ (Jᵀ W C W J + P) H⁻¹. There H = Jᵀ W J + P, with Satterthwaite's degrees of freedom{cite[satterthwaite]}. J "
    "are derivatives of residuals, W weights, C the covariance of the noise, P the precision of the priors",
    # some were asked for
    "nuisances": "nuisance parameters of the tests with Gaussian priors are {kinds}",
    # always
    "autocorrelated": "autocorrelated parts have the covariance s² exp(-d / l), d in ln t of logarithms, else in "
    "relative time. Those were kept by which the likelihood gains more than by chance in {chance:%} of cases",
    # tests state their noise
    "stated noise": "the noise of a reading has a log-normal prior about the noise that its test states, with a "
    "standard deviation of {sd:.2g} of its logarithm",
    # a reduced-order model or surrogate was corrected
    "numerical error": "numerical errors of predictions were corrected at the optimum; a tenth of them stays in the "
    "covariance",
    # of a sum
    "terms": "the terms of the sum {law} were selected by the evidence for its subsets; {dropped}",
    # some went
    "dropped": "left out were {names}",
    # none did
    "all kept": "all terms stayed",
    # several laws were fitted
    "comparison": "the laws were compared by their evidence, by Laplace's method{cite[evidence]}. Chi-square is that "
    "under the covariance of the best law, with nuisance parameters integrated out. Each parameter costs 2 ln of the "
    "factor by which the tests narrow its bounds. The weight of a law is exp(-difference / 2) over the sum of all; it "
    "is credible above {credible:g}. It is decisive above {decisive:g} if it was asked for and the tests do not reject "
    "it. Nor may a share of another law, or an effect that was not modelled, change that",
    # the noise is known
    "rejection": "tests reject a law whose chi-square against noise that was stated or estimated without it has a "
    "probability below {significance:%}",
    # there are several outputs
    "several outputs": "it is the least of those of all outputs and of each one, times their number",
    # behind both
    "rates": "they reject it, too, where rates of tests scatter by more than a factor of {factor:.2g}. So do they "
    "where a changing exponent or energy, one test, or two groups explain scatter six times better",
    # some noise is estimated
    "estimated noise": "noise that no test states is estimated from third differences of neighbouring readings, with "
    "{freedom:g} degrees of freedom each. Chi-square over its degrees of freedom then has an F distribution, or one of "
    "the mean and variance of several{cite[satterthwaite]}",
    # tests do not have a rate of their own
    "no scatter": "no scatter of creep rates between tests was allowed: every test follows the law's own rate",
    # its size was given
    "given scatter": "the creep rates of single tests have a Gaussian prior: they scatter by {scatter:.3g} % about the "
    "law (one standard deviation of their logarithm), as was given",
    # of few tests
    "unknown scatter": "how the creep rates of single tests scatter is not known, for {tests} cannot show it: the "
    "intervals hold for these",
    # its estimate is zero
    "undetected scatter": "no scatter of the creep rates of single tests about the law was detected",
    # it is not
    "scatter": "the creep rates of single tests scatter by {scatter:.3g} % about the law (one standard deviation of "
    "their logarithm), as was estimated",
    # lives do, as curves to rupture show
    "lives": "the rates of damage of single tests scatter by {lives:.3g} % beside those of creep",
    # readings or tests were
    "left out": "readings of {tests}, or whole tests, were left out for the reasons in the report",
    # laws of several temperatures
    "temperature": "forms of temperature of the parameters were chosen by regression on isothermal estimates with "
    "their covariances, over all combinations of forms",
    # strengths were assessed
    "rupture": "{tests}, run-outs as censored times and heats and laboratories as random effects, were assessed by "
    "{methods}",
    # tests were predicted
    "forecast": "bands of {level:.3g} % contain the uncertainty of parameters and of the choice of the law. They "
    "contain the scatter between tests, dimensions, noise and numerical error as well<. They come from {draws} draws "
    "in each test>",
    # tests were planned
    "design": "expected information of further tests about the {goal} was computed{cite[lindley]}",
    # always
    "software": "the work was done with creepkit {version}{cite[creepkit]}{seed}",
}
"""{kind: a sentence}, or of some a clause."""
