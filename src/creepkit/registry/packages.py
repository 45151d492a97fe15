"""Which package of this project has a law that is not installed: what a message about a missing law says to install."""

from __future__ import annotations

LAWS_BY_PACKAGE = {
    "creepkit-classic": (
        "blackburn",
        "coble",
        "dorn",
        "double-power",
        "garofalo",
        "graham-walles",
        "mpc-omega",
        "nabarro-herring",
        "norton-bailey-rate",
        "norton-bailey-strain",
        "norton-bailey-time",
        "theta-projection",
        "threshold-stress",
    ),
    "creepkit-damage": ("kachanov-rabotnov", "liu-murakami", "sinh-damage"),
    "creepkit-logarithmic": ("logarithmic",),
}
"""{package: its laws}, the packages under plugins/."""


def package_with_law(law: str) -> str:
    """The package that has a law of this name; empty when none is known to."""
    return next((package for package, laws in LAWS_BY_PACKAGE.items() if law in laws), "")
