"""Design of further tests: candidates, and those that discriminate between laws."""
