"""Which terms of a sum a fit needs: their contributions, penalties on these, and the reduced law confirmed."""
