"""Every plot and every text for a terminal; `creepkit.presentation` lists which function shows which record."""
