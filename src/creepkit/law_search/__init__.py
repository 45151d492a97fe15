"""Laws that nobody wrote down: sentences of a grammar of rate equations, proposed, fitted in full and ranked."""
