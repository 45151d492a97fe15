"""The interactive page in a browser: curves follow the sliders, nothing leaves the machine, names stay text."""

import json
import math
import shlex

import numpy as np
import pytest

import creepkit as ck
from creepkit.app.contents import page_contents
from creepkit.app.page import page_fragment
from creepkit.surrogates.parameter_gru import ParameterGru
from creepkit.surrogates.recipe import Training
from creepkit.surrogates.training import train
from helpers.browser import browser, tab
from helpers.command_line import creepkit
from helpers.http_requests import serving
from helpers.planted_datasets import bars

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
    return ck.identify("norton", histories, starts=1)


def norton_strain(n, stress, time):
    """Under a constant load: exp(-n p) = 1 - n A sigma^n t."""
    return -math.log1p(-n * A * stress**n * time) / n


def shown_end(page):
    """What the first panel says to those who cannot see it."""
    text = page.locator(".panel svg").first.get_attribute("aria-label").rpartition(" ends at ")[2].rstrip(".")
    head, _, power = text.partition("\u00b710")
    digits = str.maketrans("\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079", "-0123456789")
    return float(head) * 10.0 ** int(power.translate(digits) or 0)


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


def test_a_page_of_the_server_follows_its_sliders(chromium):
    with serving(page_contents("norton")) as server, tab(chromium) as one:
        one.open(server.url)
        settings_of_a_law(one)
        assert shown_end(one.page) == pytest.approx(norton_strain(4.5, 100.0, 72000.0), rel=1e-3)
        one.page.get_by_role("button", name="Add a step").click()
        one.type("step 2 begins at, h", "10")
        one.type("stress, step 2, MPa", "120")
        both = ck.simulate(
            "norton", "uniaxial", {"A": A, "n": N}, loading=ck.StressSteps(((0.0, 100.0), (36000.0, 120.0))),
            times=[72000.0],
        )  # fmt: skip
        assert shown_end(one.page) == pytest.approx(float(both.outputs["strain"][-1]), rel=1e-3)
        assert one.problems == []
        assert all(url.startswith(f"http://127.0.0.1:{server.server_address[1]}/") for url in one.requested)
        refused = one.page.goto(server.url.replace(server.token, "x" * len(server.token)))
        assert refused.status == 403


def test_what_the_server_refuses_is_said_on_the_page(chromium):
    with serving(page_contents("norton")) as server, tab(chromium) as one:
        one.open(server.url)
        server.shutdown()
        server.server_close()
        one.page.context.set_offline(True)
        one.page.get_by_role("textbox", name="n", exact=True).fill("5")
        one.page.get_by_role("alert").wait_for()
        assert "does not answer" in one.page.get_by_role("alert").inner_text()


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
    with serving(page_contents(hostile_law(), tests, title=HOSTILE)) as server:
        for url in (path.as_uri(), server.url):
            with tab(chromium) as one:
                one.open(url)
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


def test_a_trained_network_answers_while_a_slider_moves(chromium, tmp_path):
    data = bars(48)
    network = train(data, ParameterGru(6, 1, training=Training(epochs=2, batch=32, rate=1e-2)))
    values, plan = data.values_of(0), data.planned_test(0)
    end = float(plan.times[-1])
    stress = float(plan.loading.program().values[0])
    path = ck.interactive_page(ck.law_with_values(data.law, values), tmp_path / "page.html", surrogate=network)
    with tab(chromium) as one:
        one.open(path.as_uri())
        quick, exact = (
            one.page.evaluate(
                """([end, stress, exact]) => {
                    const data = JSON.parse(window.given), values = {};
                    for (const p of data.laws[0].parameters) values[p.name] = p.value;
                    const program = { specimen: "uniaxial", load: "stress", steps: [[0, stress]], control: "load",
                                      ramp: 0, end, temperature: 1073, modulus: null, lengths: {} };
                    const question = { law: 0, values, program, tests: [], rate_temperature: 1073, exact };
                    return creepkitPage.predict(data, question).program;
                }""".replace("window.given", json.dumps(json.dumps(page_data(path)))),
                [end, stress, e],
            )
            for e in (False, True)
        )
        assert one.problems == []
    held = plan.replace(loading=ck.constant_stress(stress))
    for answer, model in ((quick, network), (exact, ck.specimen("uniaxial"))):
        at = held.replace(times=np.array(answer["times"]))
        expected = model.predict(data.law, data.law.to_internal(values), [at]).of(0)[:, 0]
        np.testing.assert_allclose(answer["outputs"]["strain"], expected, atol=1e-4 * np.abs(expected).max())


def page_data(path):
    """What the scripts of a page read."""
    text = path.read_text(encoding="utf-8").partition('class="creepkit-page-data">')[2]
    return json.loads(text.partition("</script>")[0])


def test_a_specimen_that_nobody_registered(chromium):
    """It brings its own titles, units, loads and lengths."""
    from helpers.cantilever import Cantilever

    beam = Cantilever()
    with serving(page_contents("norton", specimen=_known(beam))) as server, tab(chromium) as one:
        one.open(server.url)
        output, load = beam.outputs[0], beam.loads[0]
        assert one.page.locator("h3").first.inner_text().lower() == output.long_name.lower()
        assert one.page.get_by_role("slider", name=load.long_name, exact=True).count() == 1
        assert one.page.get_by_text("Lengths of the test piece").count() == 1
        assert one.problems == []


def _known(specimen):
    from creepkit.records import remember_specimen

    remember_specimen(specimen)
    return specimen.name


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
