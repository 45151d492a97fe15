"""Every plot and every text for a terminal; methods of the records import what shows them."""
