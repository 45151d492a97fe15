"""Files: one way to open what a user hands over, one way to write it whole or not at all, and the codecs between."""
