"""The plot of a ranking: misfits of each law in each test, weights, and the curves of the credible laws."""

import numpy as np
import pytest

from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.inverse.selection.ranking import ranking_from_scores
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.reports.ranking import MOST_TESTS_DRAWN, misfit_name, misfits
from helpers.steady_rate_predictor import Steady, planted

QUICK = IdentificationSettings(starts=2, sobol_points=16, frames=20, weights="noise")


@pytest.fixture(scope="module")
def fits():
    tests = planted(NORTON, {"A": 1e-16, "n": 5.2}, [(s, 1050.0) for s in np.geomspace(30, 90, 8)], seed=5, noise=1e-5)
    return [identify(law, tests, Steady(), settings=QUICK) for law in (NORTON, HYPERBOLIC_SINE)]


def ranked(fits, *scores):
    return ranking_from_scores(fits, np.array(scores), "bic", independent_frames=50.0)


def test_of_two_laws_that_cannot_be_told_apart_both_are_drawn_and_named(fits, tmp_path):
    ranking = ranked(fits, 0.0, 1.0)
    figure = ranking.plot(tmp_path / "ranking.png")
    assert figure.get_suptitle().replace("\n", " ").replace("- ", "-") == ranking.verdict.replace("- ", "-")
    (legend,) = figure.subfigs[1].legends
    assert [t.get_text() for t in legend.get_texts()] == [
        "measured",
        *(f"{r.fit.law.name}, weight {r.weight:.3f}" for r in ranking.laws),
    ]
    panels = [axes for axes in figure.subfigs[1].axes if axes.get_visible()]
    assert len(panels) == MOST_TESTS_DRAWN
    assert all(len(axes.lines) == 3 for axes in panels)  # measured, and a curve of each law
    assert (tmp_path / "ranking.png").stat().st_size > 10_000


def test_misfits_are_those_of_which_the_verdict_is_the_mean(fits):
    """All tests have as many readings, so that the reduced chi-square of all is the mean of theirs."""
    ranking = ranked(fits, 0.0, 1.0)
    shown = misfits(ranking)
    np.testing.assert_allclose(shown.mean(axis=1), [r.fit.adequacy.chi_square for r in ranking.laws], rtol=1e-9)
    (image,) = ranking.plot().subfigs[0].axes[0].images
    np.testing.assert_allclose(image.get_array(), shown)
    assert "own rate" in misfit_name(ranking)
