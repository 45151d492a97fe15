"""How the parameters of a law depend on temperature: closed forms, put back into the law and judged by the tests."""
