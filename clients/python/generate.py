#!/usr/bin/env python3
"""Makes posefuse/v1 from the .proto files of the project; `--check` only says whether it is what they give.

    pip install grpcio-tools==1.76.0
    python generate.py

That version of grpcio-tools, because what it makes runs with protobuf 6 and 7 alike.
"""
import filecmp
import importlib.metadata
import pathlib
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
PROTOS = HERE.parents[1] / "proto"
TOOLS = "1.76.0"
PACKAGE = pathlib.Path("posefuse/v1")


def generate(out: pathlib.Path) -> None:
    """Writes the modules, their type stubs and the gRPC stubs under `out`."""
    from grpc_tools import protoc

    protos = sorted(str(path.relative_to(PROTOS)) for path in (PROTOS / PACKAGE).glob("*.proto"))
    options = [f"--{kind}_out={out}" for kind in ("python", "pyi", "grpc_python")]
    if protoc.main(["protoc", f"-I{PROTOS}", *options, *protos]) != 0:
        sys.exit("the .proto files do not compile")
    for stub in (out / PACKAGE).glob("*_pb2_grpc.py"):
        # Files without a service have nothing to call.
        if "Stub(object)" not in stub.read_text():
            stub.unlink()


def differences(made: pathlib.Path) -> list[str]:
    """The names of files that are missing, changed or left over."""
    there = {path.name for path in (HERE / PACKAGE).glob("*_pb2*")}
    wanted = {path.name for path in (made / PACKAGE).iterdir()}
    changed = [n for n in there & wanted if not filecmp.cmp(HERE / PACKAGE / n, made / PACKAGE / n, shallow=False)]
    return sorted([*changed, *(there ^ wanted)])


def main() -> None:
    if (found := importlib.metadata.version("grpcio-tools")) != TOOLS:
        sys.exit(f"expected grpcio-tools {TOOLS}, found {found}: pip install grpcio-tools=={TOOLS}")
    if sys.argv[1:] == ["--check"]:
        with tempfile.TemporaryDirectory() as folder:
            generate(pathlib.Path(folder))
            if stale := differences(pathlib.Path(folder)):
                sys.exit(f"posefuse/v1 is not what the .proto files give ({', '.join(stale)}): run python generate.py and commit")
        return
    for old in (HERE / PACKAGE).glob("*_pb2*"):
        old.unlink()
    generate(HERE)


if __name__ == "__main__":
    main()
