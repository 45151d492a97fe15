"""Tables of design_of_experiments.py."""

import numpy as np
from proportions import share_with_interval


def print_precision(page, rows_by_kind):
    page.heading("Precision of the rate at a stress of service")
    page.table(
        "campaigns", "number", "sd of ln rate before, median", "predicted, median", "realised, median",
        "predicted over realised: median [quartiles]", "deviation: rms",
    )  # fmt: skip
    everything = [row for rows in rows_by_kind.values() for row in rows]
    for kind, rows in {**rows_by_kind, "all": everything}.items():
        if rows:
            ratio = np.array([row["predicted"] / row["realised"] for row in rows])
            low, middle, high = np.quantile(ratio, (0.25, 0.5, 0.75))
            medians = (float(np.median([row[name] for row in rows])) for name in ("before", "predicted", "realised"))
            rms = float(np.sqrt(np.mean([row["deviation"] ** 2 for row in rows])))
            page.row(
                kind, len(rows), *(f"{m:.3g}" for m in medians), f"{middle:.2f} [{low:.2f}, {high:.2f}]",
                f"{rms:.2f}",
            )  # fmt: skip


def print_arms(page, rows, standard, shares):
    page.heading("Which law it is, by dimples")
    page.table("campaign", "number", "oven, h", "best law right", "singled out and right", "singled out, wrong",
               "decisive and right", "decisive, wrong")  # fmt: skip
    groups = {"": rows, ", planted is not norton": [row for row in rows if row["truth"] != "norton"]}
    for label, group in groups.items():
        for name in (*standard, "first", *shares):
            arm = [row[name] for row in group]
            if not arm:
                continue
            found = (
                [r["right"] for r in arm],
                [r["singled out"] and r["right"] for r in arm],
                [r["singled out"] and not r["right"] for r in arm],
                [r["decisive"] and r["right"] for r in arm],
                [r["decisive"] and not r["right"] for r in arm],
            )
            hours = f"{np.mean([r['hours'] for r in arm]):.1f}"
            page.row(name + label, len(arm), hours, *(share_with_interval(share) for share in found))


def print_expectations(page, rows, names):
    """Expected probabilities of a right verdict against those that were met."""
    expected = [(r[name]["probability"], r[name]["decisive"] and r[name]["right"]) for r in rows for name in names
                if "probability" in r.get(name, {})]  # fmt: skip
    page.table("expected probability of a right verdict", "designs", "mean", "met")
    for label, low, high in (("below 0.2", -1, 0.2), ("0.2 to 0.8", 0.2, 0.8), ("above 0.8", 0.8, 2)):
        own = [(p, hit) for p, hit in expected if low < p <= high]
        if own:
            page.row(label, len(own), f"{np.mean([p for p, _ in own]):.2f}", share_with_interval([h for _, h in own]))
