"""Creep over compositions: regression of rates, exponents and laws of many alloys, and which alloy to make next."""
