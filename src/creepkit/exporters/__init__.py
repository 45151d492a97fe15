"""Exporters: a law with its values as text for people, for programs and for finite element codes.

One exporter a file, each with an entry point of its own. A new one is a class with `name`, `title`, `suffix` and
`text(source)`.
"""
