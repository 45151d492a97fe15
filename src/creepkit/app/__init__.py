"""The interactive page of a law: its contents, its text, and the local server that answers it."""
