"""What can go wrong when pictures are made."""


class RenderError(RuntimeError):
    """No picture or movie can be made here; the message is one line and says what to do."""
