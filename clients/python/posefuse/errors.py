"""What can go wrong, each with what to do about it in its words."""


class PosefuseError(Exception):
    """Anything of this package."""


class Refused(PosefuseError):
    """The server will never take this agent as it is: its name, joint set or protocol is wrong."""


class Stopped(PosefuseError):
    """The server told the agent to stop; the words are the server's reason."""


class ServerError(PosefuseError):
    """The server did not answer, or not with what was asked for; `code` is gRPC's word for why, e.g. `NOT_FOUND`."""

    def __init__(self, words: str, code: str = "") -> None:
        super().__init__(words)
        self.code = code
