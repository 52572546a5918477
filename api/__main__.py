"""The command line: ``waywright plan | compare | certify | retime | methods | serve``. No FastAPI except to serve."""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from planner import (
    Infeasible,
    InvalidRequest,
    PlannerError,
    TooLarge,
    UnknownMethod,
    Unsupported,
    __version__,
    describe_method,
    list_methods,
)

from . import encode
from .errors import problem
from .judging import certificate
from .reading import decode, parse
from .schemas import CertifyBody, CompareBody, PlanBody, RetimeBody
from .settings import LOCAL, Caps
from .tables import aligned, certificate_table, table
from .work import Answer, answer_plan, answer_retiming, comparison

DONE, FAILED, BAD_INPUT, INFEASIBLE = 0, 1, 2, 3

#: What --out writes, by the file's ending.
OUT = {".json": encode.JSON, ".csv": encode.CSV}


class Usage(Exception):
    """The command line itself is wrong."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return the exit code: 0 done, 2 bad input, 3 infeasible, 1 anything else."""
    try:
        arguments = _parser().parse_args(argv)
    except SystemExit as stop:  # --help, --version, or a usage error that argparse has told
        return stop.code if isinstance(stop.code, int) else BAD_INPUT
    try:
        code: int = arguments.run(arguments)
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # `| head` has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return DONE
    except Usage as error:
        return _fail(str(error), BAD_INPUT)
    except InvalidRequest as error:
        for finding in error.errors[:20]:
            _fail(f"{finding.field or 'the request'}: {finding.reason} ({finding.code})", BAD_INPUT)
        return BAD_INPUT
    except (UnknownMethod, Unsupported, TooLarge) as error:
        return _fail(str(error), BAD_INPUT)
    except Infeasible as error:
        return _fail(_infeasible(error), INFEASIBLE)
    except PlannerError as error:
        return _fail(str(error), FAILED)
    except OSError as error:
        return _fail(f"{error.filename or 'error'}: {error.strerror or error}", FAILED)
    except KeyboardInterrupt:
        return _fail("interrupted", FAILED)
    except Exception as error:  # a bug of ours: one line all the same
        return _fail(f"unexpected failure, please report it: {type(error).__name__}: {error}", FAILED)


def _fail(message: str, code: int) -> int:
    print(f"waywright: {' '.join(message.split())}", file=sys.stderr)
    return code


def _infeasible(error: Infeasible) -> str:
    needed = "" if error.needed is None else f"; {error.needed:g} would do"
    return f"infeasible: {error.reason}{needed}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("waywright", description="Waypoints and limits in, a certified trajectory out.")
    parser.add_argument("--version", action="version", version=f"waywright {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    plan = commands.add_parser("plan", help="plan a trajectory", description="Plan a trajectory and certify it.")
    plan.add_argument("file", metavar="FILE", help="a plan request as JSON; - for standard input")
    plan.add_argument("-m", "--method", help="a method's id, or auto; instead of the request's")
    plan.add_argument("-o", "--option", action="append", default=[], metavar="NAME=VALUE", help="an option, as JSON")
    plan.add_argument("--out", metavar="FILE", help="write the answer to a .json or .csv file")
    plan.set_defaults(run=_plan)

    compare = commands.add_parser(
        "compare",
        help="plan with several methods",
        description="Plan with several methods. Of a plan request the method is left aside and all methods are tried.",
    )
    compare.add_argument("file", metavar="FILE", help="a comparison or a plan request as JSON; - for standard input")
    compare.set_defaults(run=_compare)

    certify = commands.add_parser("certify", help="judge a trajectory", description="Judge anyone's trajectory.")
    certify.add_argument("file", metavar="FILE", help="a certificate request as JSON; - for standard input")
    certify.set_defaults(run=_certify)

    retime = commands.add_parser(
        "retime", help="time a path anew", description="Run through a trajectory's path as fast as the limits allow."
    )
    retime.add_argument("file", metavar="FILE", help="a retiming request as JSON; - for standard input")
    retime.add_argument("--out", metavar="FILE", help="write the answer to a .json or .csv file")
    retime.set_defaults(run=_retime)

    methods = commands.add_parser("methods", help="list the methods", description="List the methods, or describe one.")
    methods.add_argument("id", metavar="ID", nargs="?", help="a method's id")
    methods.set_defaults(run=_methods)

    serve = commands.add_parser("serve", help="run the service", description="Run the service until interrupted.")
    serve.add_argument("--host", default="127.0.0.1", help="address to listen on (default 127.0.0.1)")
    serve.add_argument("--port", type=_port, default=8000, help="port to listen on (default 8000; 0: any free one)")
    serve.set_defaults(run=_serve)
    return parser


def _port(text: str) -> int:
    port = int(text)
    if not 0 <= port <= 65535:
        raise ValueError(text)
    return port


def _read(file: str) -> Any:
    try:
        return decode(sys.stdin.buffer.read() if file == "-" else Path(file).read_bytes())
    except OSError as error:
        raise Usage(f"{file}: {error.strerror or error}") from None


def _plan(arguments: argparse.Namespace) -> int:
    media_type, value = _media_type(arguments.out), _read(arguments.file)
    if isinstance(value, dict):
        if arguments.method is not None:
            value["method"] = arguments.method
        options = {} if value.get("options") is None else value["options"]
        if arguments.option and isinstance(options, dict):  # what is no object is refused with the rest
            value["options"] = {**options, **dict(_option(text) for text in arguments.option)}
    return _deliver(answer_plan(parse(PlanBody, value), LOCAL, media_type), arguments.out)


def _retime(arguments: argparse.Namespace) -> int:
    media_type, body = _media_type(arguments.out), parse(RetimeBody, _read(arguments.file))
    return _deliver(answer_retiming(body, LOCAL, media_type), arguments.out)


def _media_type(out: str | None) -> str:
    """Return the format of the file to be written; JSON where there is none."""
    media_type = encode.JSON if out is None else OUT.get(Path(out).suffix.lower())
    if media_type is None:
        raise Usage(f"{out}: cannot write this format; available: {', '.join(OUT)}")
    return media_type


def _deliver(answer: Answer, out: str | None) -> int:
    """Write an answer to a file, or print its certificate."""
    if out is not None:
        _write(Path(out), answer.content)
        print(f"wrote {out}")
        return DONE
    tree = decode(answer.content)
    print(f"method: {tree['method']}" + (f" ({tree['picked_because']})" if "picked_because" in tree else ""))
    print(f"duration: {tree['duration']:.6g} s")
    print(certificate_table(tree["certificate"]))
    for warning in tree["warnings"]:
        print(f"note: {warning['message']}")
    return DONE


def _option(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise Usage(f"-o {text}: expected NAME=VALUE")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def _write(path: Path, content: bytes) -> None:
    """Write a file in full or not at all."""
    try:
        _replace(path, content)
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError, PermissionError) as error:
        raise Usage(f"{path}: {error.strerror or error}") from None
    except OSError as error:  # it names the temporary file
        error.filename, error.filename2 = str(path), None
        raise


def _replace(path: Path, content: bytes) -> None:
    handle, partial = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(partial, 0o666 & ~mask)
        os.replace(partial, path)
    except BaseException:
        Path(partial).unlink(missing_ok=True)
        raise


def _compare(arguments: argparse.Namespace) -> int:
    value = _read(arguments.file)
    if isinstance(value, dict) and "methods" not in value:
        value = {k: v for k, v in value.items() if k not in ("method", "options")} | {"methods": "all"}
    print(table(comparison(parse(CompareBody, value), LOCAL, problem)["rows"]))
    return DONE


def _certify(arguments: argparse.Namespace) -> int:
    body = parse(CertifyBody, _read(arguments.file))
    print(certificate_table(certificate(body, LOCAL)["certificate"]))
    return DONE


def _methods(arguments: argparse.Namespace) -> int:
    if arguments.id is None:
        lines = [[m["id"], m["family"], m["timing"], m["title"]] for m in list_methods()]
        print(aligned(["method", "family", "timing", "title"], lines))
        return DONE
    entry = describe_method(arguments.id)
    for name in ("id", "title", "family", "summary", "formula", "timing", "path", "objective", "continuity"):
        print(f"{name}: {entry[name]}")
    for name in ("requires", "honours"):
        print(f"{name}: {', '.join(entry[name]) or 'nothing'}")
    print("reference: {authors}, {title}, {year}, {where}".format(**entry["reference"]))
    for name, schema in entry["options"].get("properties", {}).items():
        print(f"option {name}: {schema.get('description', '')} (default {json.dumps(schema.get('default'))})")
    return DONE


def _serve(arguments: argparse.Namespace) -> int:
    try:
        from .serving import serve
    except ImportError as error:
        return _fail(f"serving needs FastAPI and uvicorn ({error}): pip install 'waywright[service]'", FAILED)
    try:
        Caps.from_environment()
    except ValueError as error:
        raise Usage(str(error)) from None
    return serve(arguments.host, arguments.port)


if __name__ == "__main__":
    sys.exit(main())
