"""What readers are installed into: an environment each, because they want different versions of the same packages.

An environment is made once, and again when its requirements change.
"""
import json
import pathlib
import shutil
import subprocess
import threading

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: The Python that wheels of Blender's module are made for.
PYTHON = (3, 11)
#: Readers that share an environment wait for whoever installs it. One at a time, for all use the same network.
INSTALLING = threading.Lock()


class Unavailable(Exception):
    """A reader cannot be had on this machine; the words say why and what would help."""


def python(tools: pathlib.Path, requirements: pathlib.Path) -> pathlib.Path:
    """The Python of the environment that these requirements ask for."""
    folder = tools / "readers" / requirements.stem
    interpreter, done = folder / "bin/python", folder / "requirements.done"
    with INSTALLING:
        if not (done.exists() and done.read_bytes() == requirements.read_bytes()):
            shutil.rmtree(folder, ignore_errors=True)
            run([base(), "-m", "venv", folder])
            run([interpreter, "-m", "pip", "install", "-q", "--disable-pip-version-check", "-r", requirements])
            shutil.copy(requirements, done)
    return interpreter


def base() -> str:
    """A Python of the version that all readers have wheels for."""
    name = "python{}.{}".format(*PYTHON)
    for candidate in (name, "python3"):
        if (found := shutil.which(candidate)) is None:
            continue
        check = f"import sys, ensurepip; sys.exit(sys.version_info[:2] != {PYTHON})"
        if subprocess.run([found, "-c", check], capture_output=True).returncode == 0:
            return found
    raise Unavailable(f"needs {name} with venv, which is not here: install it (Debian 12: apt-get install python3-venv)")


def example(name: str) -> pathlib.Path:
    """An example of our workspace; built with all of it, because alone it would have its dependencies built anew."""
    said = run(["cargo", "build", "--quiet", "--locked", "--workspace", "--example", name, "--message-format", "json"])
    built = [json.loads(line) for line in said.splitlines()]
    return next(pathlib.Path(each["executable"]) for each in built if each.get("executable") and each["target"]["name"] == name)


def run(command: list) -> str:
    """What a command prints."""
    done = subprocess.run(list(map(str, command)), cwd=ROOT, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))} gave {done.returncode}:\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return done.stdout


def node_modules(tools: pathlib.Path, package: pathlib.Path) -> pathlib.Path:
    """The modules that this folder's `package-lock.json` asks for."""
    folder, lock = tools / "readers" / package.name, package / "package-lock.json"
    done = folder / "lock.done"
    with INSTALLING:
        if not (done.exists() and done.read_bytes() == lock.read_bytes()):
            shutil.rmtree(folder, ignore_errors=True)
            shutil.copytree(package, folder, ignore=shutil.ignore_patterns("node_modules"))
            run(["npm", "ci", "--no-audit", "--no-fund", "--silent", "--prefix", folder])
            shutil.copy(lock, done)
    return folder / "node_modules"
