"""Code made from the .proto files by `generate.py`; the messages of the wire."""
