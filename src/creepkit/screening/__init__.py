"""Screening of many alloys: the law of each is identified from its own tests, and the alloys are compared."""
