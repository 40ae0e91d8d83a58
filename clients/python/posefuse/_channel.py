"""Addresses as people write them, and channels to them."""
from __future__ import annotations

import os
import urllib.parse

import grpc

DEFAULT_SERVER = "http://127.0.0.1:7400"

#: Idle connections are probed, so that a reader notices a server that is gone. Every channel has a connection of its own,
#: made at once: retries are ours to pace. No proxy: rooms are on the local network.
OPTIONS = (
    ("grpc.keepalive_time_ms", 1000),
    ("grpc.keepalive_timeout_ms", 2000),
    ("grpc.keepalive_permit_without_calls", 1),
    ("grpc.http2.max_pings_without_data", 0),
    ("grpc.use_local_subchannel_pool", 1),
    ("grpc.enable_http_proxy", 0),
)


def parse_server(text: str | None) -> str:
    """`host:port` of `127.0.0.1:7400`, `http://studio:7400` or, given none, of POSEFUSE_SERVER or this machine."""
    text = text or os.environ.get("POSEFUSE_SERVER") or DEFAULT_SERVER
    wrong = ValueError(f"server {text!r}: expected host and port, e.g. 127.0.0.1:7400 or http://studio:7400")
    try:
        parts = urllib.parse.urlsplit(text if "://" in text else f"http://{text}")
        port = parts.port
    except ValueError:
        raise wrong from None
    if parts.scheme != "http" or not parts.hostname or port is None or parts.path not in ("", "/") or " " in text:
        raise wrong
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    return f"{host}:{port}"


def open_channel(server: str) -> grpc.Channel:
    """A channel to `host:port`."""
    return grpc.insecure_channel(server, options=OPTIONS)
