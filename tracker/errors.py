"""The one exception a user can cause."""


class OperatorError(Exception):
    """Say in one line what the operator must mend.

    The text names what is wrong, the value with its unit, the limit and the remedy. The command line prints it
    on stderr and ends with exit code 2; anything else that escapes is a bug.
    """
