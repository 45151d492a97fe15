"""Plates of alloys: the tests of many alloys screened one alloy after another, and what they say together."""
