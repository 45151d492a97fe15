"""How the parameters of a law depend on temperature: closed forms, put back into the law and compared on the tests."""
