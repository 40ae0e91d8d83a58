"""Open Sound Control 1.0 packets, read with Python's standard library only.

Bundles (nested ones, too) and messages with integers, floats and strings: what VMC and plain OSC of motion capture use.
"""
import struct

#: Bundles in bundles in bundles are nobody's motion.
DEEPEST = 8


class Malformed(ValueError):
    """The bytes are no OSC packet; the words say what was expected."""


def messages(packet: bytes, depth: int = 0) -> list[tuple[str, list]]:
    """The messages of a packet in order: address and arguments.

    Raises Malformed, and then nothing of the packet counts.
    """
    if packet.startswith(b"#bundle\0"):
        if depth == DEEPEST:
            raise Malformed(f"more than {DEEPEST} bundles in each other")
        found, at = [], 16
        while at < len(packet):
            (size,) = unpack(">i", packet, at)
            at += 4
            if size < 0 or at + size > len(packet):
                raise Malformed(f"an element of {size} bytes where {len(packet) - at} are left")
            found += messages(packet[at : at + size], depth + 1)
            at += size
        return found
    if not packet.startswith(b"/"):
        raise Malformed("neither a bundle nor an address")
    address, at = text(packet, 0)
    # Very old senders leave the types out; without them nothing can be told of what follows.
    types, at = text(packet, at) if at < len(packet) else (",", at)
    arguments = []
    for kind in types[1:]:
        value, at = argument(kind, packet, at)
        arguments.append(value)
    return [(address, arguments)]


def argument(kind: str, packet: bytes, at: int) -> tuple[object, int]:
    """The argument of this type that begins there, and where it ends."""
    if kind == "s":
        return text(packet, at)
    if kind in "TFN":
        return {"T": True, "F": False, "N": None}[kind], at
    layouts = {"i": ">i", "f": ">f", "d": ">d", "h": ">q", "t": ">Q"}
    if kind not in layouts:
        raise Malformed(f"an argument of type {kind!r}")
    (value,) = unpack(layouts[kind], packet, at)
    return value, at + struct.calcsize(layouts[kind])


def text(packet: bytes, at: int) -> tuple[str, int]:
    """The text that begins there, and where what follows it begins: texts are padded to four bytes."""
    end = packet.find(b"\0", at)
    if end < 0:
        raise Malformed("a text without an end")
    return packet[at:end].decode("utf-8", "replace"), end + 4 - end % 4


def unpack(layout: str, packet: bytes, at: int) -> tuple:
    """`struct.unpack_from`, with our own error."""
    try:
        return struct.unpack_from(layout, packet, at)
    except struct.error as error:
        raise Malformed(str(error)) from None
