"""Titles of laws in the sentences of a report."""

import creepkit as ck
from creepkit.reports.html.law_names import LawNames, title_in_sentence

NORTON, HARDENING = ck.law("norton"), ck.law("strain-hardening")


def test_titles_within_a_sentence():
    assert title_in_sentence(NORTON) == "Norton power law"  # a person stays large
    assert title_in_sentence(HARDENING) == "strain-hardening power law"
    warm = HARDENING.times(ck.arrhenius())
    assert title_in_sentence(warm) == "strain-hardening power law with Arrhenius temperature dependence"
    assert title_in_sentence(ck.law("mpc-omega")) == "MPC Omega"  # what follows a colon explains the title
    assert title_in_sentence(HARDENING + NORTON) == "strain-hardening power law + Norton power law"


def test_names_are_replaced_as_a_whole():
    """The name of a sum, or of a reduced law, holds those of others."""
    total = NORTON + HARDENING
    names = LawNames([NORTON, HARDENING, total])
    text = names.in_text("decisive: norton+strain-hardening, not norton (norton: 0.2) or strain-hardening(m=0)")
    both = "Norton power law + strain-hardening power law"
    assert text == f"decisive: {both}, not Norton power law (Norton power law: 0.2) or strain-hardening(m=0)"


def test_a_dependence_on_temperature_that_all_laws_share_is_left_out():
    warm, steady = HARDENING.times(ck.arrhenius()), NORTON.times(ck.arrhenius())
    text = f"the best is {warm.name}, not {steady.name}"
    assert LawNames([warm, steady]).in_text(text) == "the best is strain-hardening power law, not Norton power law"
    other = LawNames([warm, NORTON]).in_text(text)
    assert "strain-hardening power law with Arrhenius temperature dependence" in other


def test_a_law_called_by_a_word_of_findings_keeps_its_name():
    names = LawNames([NORTON.rename("best"), HARDENING.rename("combined")])
    text = "of 2 laws tried combined is best"
    assert names.in_text(text) == "of 2 laws tried strain-hardening power law is best"


def test_laws_of_one_title_keep_their_names_too():
    names = LawNames([NORTON, NORTON.rename("norton-2")])
    assert names.in_text("norton and norton-2") == "Norton power law (norton) and Norton power law (norton-2)"


def test_without_laws_a_text_stays():
    assert LawNames([]).in_text("norton") == "norton"
