"""The interactive page in a browser: curves follow the sliders, nothing leaves the machine, names stay text."""

import json
import math
import shlex

import numpy as np
import pytest

import creepkit as ck
from creepkit.app.contents import page_contents
from creepkit.app.page import page_fragment
from helpers.browser import browser, tab
from helpers.command_line import creepkit

A, N = 1e-16, 4.5
HOSTILE = "</script><img src=x onerror='window.harmed=1'><script>window.harmed=1</script>"


@pytest.fixture(scope="module")
def chromium():
    with browser() as started:
        yield started


@pytest.fixture(scope="module")
def histories():
    """Three bars by Norton's law with n = 4.5, and noise of 1e-5."""
    noise = np.random.default_rng(3).normal(0.0, 1e-5, (3, 40))
    runs = []
    for k, stress in enumerate((80.0, 100.0, 120.0)):
        times = np.linspace(1e4, 2e5, 40)
        run = ck.simulate("norton", "uniaxial", {"A": A, "n": N}, loading=ck.constant_stress(stress), times=times)
        run = ck.History(
            name=f"bar {k}", times=times, outputs={"strain": run.outputs["strain"] + noise[k]}, temperature=1073.0,
            loading=ck.constant_stress(stress), standard_deviation={"strain": 1e-5},
        )  # fmt: skip
        runs.append(run)
    return runs


@pytest.fixture(scope="module")
def fit(histories):
    return ck.identify("norton", histories, starts=1, nuisances=[], usual_errors="none")  # loads are exact


def norton_strain(n, stress, time):
    """Under a constant load: exp(-n p) = 1 - n A sigma^n t."""
    return -math.log1p(-n * A * stress**n * time) / n


def shown_end(page):
    """What the first panel says to those who cannot see it; a strain as a ratio."""
    text = page.locator(".panel svg").first.get_attribute("aria-label").rpartition(" ends at ")[2].rstrip(".")
    number, _, unit = text.partition(" ")
    head, _, power = number.partition("\u00b710")
    digits = str.maketrans("\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079", "-0123456789")
    return (0.01 if unit == "%" else 1.0) * float(head) * 10.0 ** int(power.translate(digits) or 0)


def settings_of_a_law(tab):
    """Values by which the closed form is known."""
    tab.type("A, 1/s", "1e-16")
    tab.type("n", "4.5")
    tab.type("stress, MPa", "100")
    tab.type("end of the test, h", "20")


def test_a_page_in_one_file_follows_its_sliders(chromium, tmp_path):
    path = ck.interactive_page("norton", tmp_path / "page.html")
    assert path.stat().st_size < 1_000_000
    with tab(chromium) as one:
        one.open(path.as_uri())
        settings_of_a_law(one)
        assert shown_end(one.page) == pytest.approx(norton_strain(4.5, 100.0, 72000.0), rel=1e-3)
        before = one.curves()
        one.type("n", "4.6")
        assert shown_end(one.page) == pytest.approx(norton_strain(4.6, 100.0, 72000.0), rel=1e-3)
        assert one.curves() != before
        slider = one.page.get_by_role("slider", name="n", exact=True)
        slider.focus()
        one.page.keyboard.press("ArrowRight")
        one.settle()
        moved = one.page.evaluate("document.querySelector('.creepkit-page') && document.activeElement.ariaValueText")
        assert float(moved) > 4.6
        assert shown_end(one.page) == pytest.approx(norton_strain(float(moved), 100.0, 72000.0), rel=2e-2)
        assert one.problems == []
        assert all(url.startswith("file://") for url in one.requested)


def test_steps_of_the_load_are_those_of_the_specimen(chromium, tmp_path):
    path = ck.interactive_page("norton", tmp_path / "page.html")
    with tab(chromium) as one:
        one.open(path.as_uri())
        settings_of_a_law(one)
        one.page.get_by_role("button", name="Add a step").click()
        one.type("step 2 begins at, h", "10")
        one.type("stress, step 2, MPa", "120")
        both = ck.simulate(
            "norton", "uniaxial", {"A": A, "n": N}, loading=ck.StressSteps(((0.0, 100.0), (36000.0, 120.0))),
            times=[72000.0],
        )  # fmt: skip
        assert shown_end(one.page) == pytest.approx(float(both.outputs["strain"][-1]), rel=1e-3)
        assert one.problems == []


def test_measured_tests_and_the_optimum(chromium, fit, histories, tmp_path):
    path = ck.interactive_page(fit, tmp_path / "page.html", tests=histories)
    with tab(chromium) as one:
        one.open(path.as_uri())
        page = one.page

        def misfit():
            return float(page.locator(".total").inner_text().split("These curves lie ")[1].split()[0])

        assert misfit() == pytest.approx(1.0, abs=0.25)  # noise alone
        assert page.locator(".interval:visible").count() == 2
        assert page.locator(".optimum:visible").count() == 2
        best = fit.values["n"]
        n = best + 0.7 * (next(e.high for e in fit.estimates if e.name == "n") - best)
        one.type("n", f"{n:.6g}")
        alone = misfit()
        page.get_by_role("button", name="Back to the optimum").click()
        one.settle()
        page.get_by_label("the others follow to their likely values").check()
        one.type("n", f"{n:.6g}")
        assert 1.0 < misfit() < 0.2 * alone  # a likely direction stays near the tests
        page.get_by_role("button", name="Back to the optimum").click()
        one.settle()
        assert misfit() == pytest.approx(1.0, abs=0.25)
        assert one.problems == []


def test_values_are_copied_in_three_forms(chromium, tmp_path):
    path = ck.interactive_page("norton", tmp_path / "page.html")
    with tab(chromium) as one:
        one.open(path.as_uri())
        settings_of_a_law(one)
        texts = {}
        for name in ("JSON", "LaTeX", "Command line"):
            one.page.get_by_role("button", name=name, exact=True).click()
            texts[name] = one.page.get_by_label("text to copy").input_value()
        end = shown_end(one.page)
    copied = json.loads(texts["JSON"])
    assert (copied["law"], copied["values"]["n"]) == ("norton", 4.5)
    assert r"A &= 1 \times 10^{-16}\,\mathrm{s}^{-1}" in texts["LaTeX"]
    assert texts["LaTeX"].count(r"\begin{align}") == texts["LaTeX"].count(r"\end{align}") == 1
    program, *words = shlex.split(texts["Command line"])
    assert program == "creepkit"
    last = creepkit(*words).stdout.split()[-1]
    assert float(last.split(",")[1]) == pytest.approx(end, rel=1e-3)


def hostile_law():
    law = ck.law("norton")
    (first, param), *rest = law.params.items()
    loud = ck.Param(HOSTILE, param.bounds, unit="1/s", scale=param.scale, off=param.off)
    return ck.CreepLaw(name=HOSTILE, title=HOSTILE, terms=dict(law.terms), params={first: loud, **dict(rest)})


def test_names_are_text(chromium, histories, tmp_path):
    tests = [h.replace(name=HOSTILE) for h in histories[:1]]
    path = ck.interactive_page(hostile_law(), tmp_path / "page.html", tests=tests, title=HOSTILE)
    with tab(chromium) as one:
        one.open(path.as_uri())
        assert one.page.evaluate("window.harmed") is None
        assert HOSTILE in one.page.title()
        assert one.page.locator("h2").inner_text() == HOSTILE
        assert one.page.get_by_text(HOSTILE).count() >= 3
        assert one.page.locator("img").count() == 0
        assert one.problems == []


def test_a_dimple_in_a_page_of_one_file(chromium, tmp_path):
    path = ck.interactive_page("norton", tmp_path / "page.html", specimen="bulge")
    assert path.stat().st_size < 1_000_000
    with tab(chromium) as one:
        one.open(path.as_uri())
        given = {"A, 1/s": "1e-16", "n": "5", "gas pressure, MPa": "9", "Young's modulus, GPa": "150"}
        for name, value in given.items():
            one.type(name, value)
        one.type("end of the test, h", "8")
        run = ck.simulate(
            "norton", "bulge", {"A": 1e-16, "n": 5.0}, loading=ck.load_steps("pressure", [(0.0, 9.0)], 5.0),
            times=[28800.0], elastic=ck.Elastic(150e3),
        )  # fmt: skip
        assert shown_end(one.page) == pytest.approx(float(run.outputs["amplitude"][-1]), rel=0.01)
        titles = one.page.locator("h3").all_inner_texts()
        assert titles[:4] == ["Amplitude", "Width", "Shape", "Deformed section"]
        assert one.problems == []


def test_several_pages_in_one_document(chromium, tmp_path):
    first, second = page_contents("norton"), page_contents("hyperbolic-sine")
    text = f"<!DOCTYPE html><title>two</title>{page_fragment(second, style=False, scripts=False)}{page_fragment(first)}"
    (tmp_path / "two.html").write_text(text, encoding="utf-8")
    with tab(chromium) as one:
        one.open((tmp_path / "two.html").as_uri())
        assert one.page.locator(".creepkit-page .title").all_inner_texts() == [second.title, first.title]
        assert len(one.curves()) == 4
        assert one.problems == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [380, 1400])
def test_it_fits_the_screen(chromium, fit, histories, tmp_path, scheme, width):
    path = ck.interactive_page(fit, tmp_path / "page.html", tests=histories)
    with tab(chromium, viewport={"width": width, "height": 900}, color_scheme=scheme) as one:
        one.open(path.as_uri())
        assert one.page.evaluate("document.documentElement.scrollWidth") <= width
        assert one.page.locator(".panel svg").first.is_visible()
        ink, ground = (
            one.page.evaluate(f"getComputedStyle(document.querySelector('.creepkit-page')).{name}").strip("rgb()")
            for name in ("color", "backgroundColor")
        )
        assert contrast(ink, ground) > 7.0
        unnamed = one.page.evaluate(
            "[...document.querySelectorAll('input, select, textarea, button')].filter((e) => !(e.ariaLabel || "
            "e.labels?.length || e.innerText)).length"
        )
        assert unnamed == 0


CUT_OFF = """() => {
    const wrong = [], wide = document.documentElement.clientWidth;
    for (const panel of document.querySelectorAll('.panel')) {
        if (!panel.offsetWidth) continue;
        const frame = panel.getBoundingClientRect();
        for (const part of panel.querySelectorAll('svg text, h3, button, input, .legend')) {
            if (!part.getClientRects().length) continue;
            const place = part.getBoundingClientRect();
            const inside = place.left >= frame.left - 1 && place.right <= frame.right + 1
                && place.top >= frame.top - 1 && place.bottom <= frame.bottom + 1;
            if (!inside) wrong.push(part.textContent || part.outerHTML);
            if (part.matches('svg text') && parseFloat(getComputedStyle(part).fontSize) < 9) wrong.push('small');
        }
    }
    for (const part of document.querySelectorAll('.controls *, .panels')) {
        const style = getComputedStyle(part);
        const scrolls = part.scrollWidth > part.clientWidth + 1 && /auto|scroll/.test(style.overflowX);
        if (scrolls || part.getBoundingClientRect().right > wide + 1) wrong.push(part.outerHTML.slice(0, 80));
    }
    return wrong;
}"""
"""What of the page is cut off, beyond the screen, or has to be scrolled sideways."""


def in_sight(page):
    """Titles of the panels that are wholly in the window."""
    return page.evaluate(
        "[...document.querySelectorAll('.panel')].filter((p) => { const r = p.getBoundingClientRect(); return r.height "
        "&& r.top >= 0 && r.bottom <= innerHeight + 1; }).map((p) => p.querySelector('.name').textContent)"
    )


PANELS = ["Amplitude", "Width", "Shape", "Deformed section", "Creep rate against stress"]


def test_panels_stay_in_sight_and_whole_while_sliders_move(chromium, tmp_path):
    path = ck.interactive_page("norton", tmp_path / "page.html", specimen="bulge")
    for width, panels in ((1250, PANELS), (800, PANELS), (400, PANELS[:1])):
        with tab(chromium, viewport={"width": width, "height": 800}) as one:
            one.open(path.as_uri())
            for name in ("A", "Young's modulus"):
                one.page.get_by_role("slider", name=name).first.scroll_into_view_if_needed()
                assert in_sight(one.page) == panels
                assert one.page.evaluate(CUT_OFF) == []
            if width == 400:
                for title in PANELS:
                    one.page.get_by_label("plot that is shown").select_option(label=title)
                    one.page.wait_for_timeout(50)
                    assert in_sight(one.page) == [title]
                    assert one.page.evaluate(CUT_OFF) == []
            assert one.problems == []


def contrast(first, second):
    """Of two colours, as in WCAG 2.2, section 1.4.3."""

    def luminance(text):
        shares = [float(part) / 255.0 for part in text.split(",")]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in shares]
        return float(np.dot(linear, (0.2126, 0.7152, 0.0722)))

    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)
