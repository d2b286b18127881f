"""Rigs of another maker: a simulator with forms that neither the library nor the trials have, and a table of
what the diagnosis says of them. ``python -m tests.foreign`` prints it.
"""
