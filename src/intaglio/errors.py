"""The one exception for input that cannot be used."""


class InputError(ValueError):
    """Bad input: one line that names the file or argument, the value, and the remedy."""
