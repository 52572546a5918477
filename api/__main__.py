"""The command line: ``waywright plan | compare | certify | … | serve | key``. No FastAPI except to serve."""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
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

from .controllers import CONTROLLERS, Controller, Unfit, fitted, limits_of
from .draft import Draft
from .errors import problem
from .exports import EXPORTS, Export, export_of
from .formats import written
from .judging import certificate
from .keys import new_key
from .media import JSON, MSGPACK
from .reading import decode, included, parse
from .schemas import CertifyBody, CompareBody, PlanBody, RetimeBody
from .settings import LOCAL, Settings
from .tables import aligned, certificate_table, table
from .work import comparison, draft_plan, draft_retiming

DONE, FAILED, BAD_INPUT, INFEASIBLE = 0, 1, 2, 3


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
    except (Usage, Unfit) as error:
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
    _add_out(plan)
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
    _add_out(retime)
    retime.set_defaults(run=_retime)

    methods = commands.add_parser("methods", help="list the methods", description="List the methods, or describe one.")
    methods.add_argument("id", metavar="ID", nargs="?", help="a method's id")
    methods.set_defaults(run=_methods)

    serve = commands.add_parser("serve", help="run the service", description="Run the service until interrupted.")
    serve.add_argument("--host", default="127.0.0.1", help="address to listen on (default 127.0.0.1)")
    serve.add_argument("--port", type=_port, default=8000, help="port to listen on (default 8000; 0: any free one)")
    serve.add_argument("--api-keys", metavar="FILE", help="the keys that are admitted, made with: waywright key NAME")
    serve.add_argument("--insecure", action="store_true", help="let other machines in without keys")
    serve.set_defaults(run=_serve)

    key = commands.add_parser(
        "key", help="make an API key", description="Make an API key, and the line of the keys file that admits it."
    )
    key.add_argument("name", metavar="NAME", help="whose key it is: letters, digits, dots, dashes, underscores")
    key.set_defaults(run=_key)
    return parser


def _add_out(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", metavar="FILE", help=f"write the answer to a file: {', '.join(EXPORTS)}")
    parser.add_argument("--dt", type=float, metavar="SECONDS", help="sampling period, instead of the request's")
    says = "sample as this robot controller does, and check what it will see before anything is written"
    parser.add_argument("--controller", choices=list(CONTROLLERS), help=says)


def _port(text: str) -> int:
    port = int(text)
    if not 0 <= port <= 65535:
        raise ValueError(text)
    return port


def _read(file: str) -> Any:
    coding = MSGPACK if file.lower().endswith(".msgpack") else JSON
    try:
        return decode(sys.stdin.buffer.read() if file == "-" else Path(file).read_bytes(), coding)
    except OSError as error:
        raise Usage(f"{file}: {error.strerror or error}") from None


def _plan(arguments: argparse.Namespace) -> int:
    export, value = _export(arguments.out), _read(arguments.file)
    if isinstance(value, dict):
        if arguments.method is not None:
            value["method"] = arguments.method
        options = {} if value.get("options") is None else value["options"]
        if arguments.option and isinstance(options, dict):  # what is no object is refused with the rest
            value["options"] = {**options, **dict(_option(text) for text in arguments.option)}
    body = parse(PlanBody, _sampled(value, arguments))
    _refuse_without_samples(body, export, arguments.controller)
    return _deliver(draft_plan(body, LOCAL), body, export, arguments)


def _retime(arguments: argparse.Namespace) -> int:
    export = _export(arguments.out)
    body = parse(RetimeBody, _sampled(_read(arguments.file), arguments))
    _refuse_without_samples(body, export, arguments.controller)
    return _deliver(draft_retiming(body, LOCAL), body, export, arguments)


def _export(out: str | None) -> Export | None:
    """Return what writes the file; None where there is none to be written."""
    if out is None:
        return None
    export = export_of(Path(out).name)
    if export is None:
        raise Usage(f"{out}: cannot write this format; available: {', '.join(EXPORTS)}")
    if export.missing:
        extra = f"pip install 'waywright[{export.extra}]'"
        raise Usage(f"{out}: writing {export.suffix} needs {export.library}, which is not installed: {extra}")
    return export


def _sampled(value: Any, arguments: argparse.Namespace) -> Any:
    """Return the request with the sampling period of the command line."""
    dt = _period(arguments)
    if dt is None or not isinstance(value, dict):
        return value
    if value.get("sampling") is not None:
        raise Usage("/sampling: the file says where to sample, and so does --dt or --controller; give one of them")
    return {**value, "sampling": {"dt": dt}}


def _period(arguments: argparse.Namespace) -> float | None:
    """Return the sampling period that the command line asks for, s."""
    dt: float | None = arguments.dt
    if dt is not None and not 0.0 < dt < float("inf"):
        raise Usage(f"--dt {dt:g}: must be > 0")
    if arguments.controller is None:
        return dt
    controller = CONTROLLERS[arguments.controller]
    if dt is None:
        return controller.period
    periods = round(dt / controller.period)
    if abs(dt - periods * controller.period) > 1e-9 * dt or periods < 1 or (periods > 1 and not controller.multiples):
        also = " or a whole multiple of it" if controller.multiples else ""
        raise Usage(f"--dt {dt:g}: {controller.name} takes a sample every {controller.period:g} s{also}")
    return periods * controller.period


def _refuse_without_samples(body: PlanBody | RetimeBody, export: Export | None, controller: str | None) -> None:
    if "samples" in included(body):
        return
    needs = f"--controller {controller}" if controller else export.suffix if export and export.samples else None
    if needs is not None:
        raise InvalidRequest.of("/include", "conflict", f"{needs} needs samples, which are not included")


def _deliver(draft: Draft, body: PlanBody | RetimeBody, export: Export | None, arguments: argparse.Namespace) -> int:
    """Write an answer to a file, or print its certificate."""
    checked = None
    if arguments.controller is not None:
        draft, checked = _fitted(draft, body, CONTROLLERS[arguments.controller], arguments)
    if export is not None:
        _write(Path(arguments.out), export.write(draft))
        print(f"wrote {arguments.out}")
    else:
        tree = decode(written(replace(draft, tree={k: v for k, v in draft.tree.items() if k != "samples"}), JSON))
        print(f"method: {tree['method']}" + (f" ({tree['picked_because']})" if "picked_because" in tree else ""))
        print(f"duration: {tree['duration']:.6g} s")
        print(certificate_table(tree["certificate"]))
    for warning in draft.tree["warnings"] if export is None or checked else ():
        print(f"note: {warning['message']}")
    if checked:
        print(f"checked: {checked}")
    return DONE


def _fitted(
    draft: Draft, body: PlanBody | RetimeBody, controller: Controller, arguments: argparse.Namespace
) -> tuple[Draft, str]:
    """Return the draft with the samples that the controller sees, checked against the limits of the request."""
    dt = _period(arguments)
    assert dt is not None
    return fitted(draft, controller, dt, *limits_of(body, draft.joints), LOCAL.samples)


def _option(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise Usage(f"-o {text}: expected NAME=VALUE")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def _write(path: Path, content: Iterable[bytes]) -> None:
    """Write a file in full or not at all."""
    try:
        _replace(path, content)
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError, PermissionError) as error:
        raise Usage(f"{path}: {error.strerror or error}") from None
    except OSError as error:  # it names the temporary file
        error.filename, error.filename2 = str(path), None
        raise


def _replace(path: Path, content: Iterable[bytes]) -> None:
    handle, partial = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.writelines(content)
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
        from .serving import Misconfigured, serve
    except ImportError as error:
        return _fail(f"serving needs FastAPI and uvicorn ({error}): pip install 'waywright[service]'", FAILED)
    try:
        settings = Settings.from_environment()
    except ValueError as error:
        raise Usage(str(error)) from None
    if arguments.api_keys == "":  # an unset variable in a script shall not open the service
        raise Usage("--api-keys needs the name of a file")
    if arguments.api_keys is not None:
        settings = replace(settings, api_keys=arguments.api_keys)
    try:
        return serve(arguments.host, arguments.port, settings, arguments.insecure)
    except Misconfigured as error:
        raise Usage(str(error)) from None


def _key(arguments: argparse.Namespace) -> int:
    try:
        key, line = new_key(arguments.name)
    except ValueError as error:
        raise Usage(str(error)) from None
    print(f"key, to be given to its owner; it is not kept anywhere: {key}")
    print(f"line for the keys file: {line}")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
