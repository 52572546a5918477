"""Run the campaigns: ``python -m benchmarks.campaign [NAME …] [--size ci|campaign|N] [--fresh]``.

``python -m benchmarks.campaign replay FILE`` sends the bytes that a failure left to a service and tells the answer.
"""

import argparse
import asyncio
import os
import sys
from pathlib import Path

# Before NumPy is imported: the threads of its libraries would take the service's time.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"


def _fast() -> None:
    """Take the faster event loop where it is installed: a load generator shall not be what is measured."""
    try:
        import uvloop
    except ImportError:
        return
    asyncio.set_event_loop_policy(uvloop.EventLoopPolicy())


def main(arguments: list[str] | None = None) -> int:
    """Run what is asked, go on where a run was killed, and say where the report is."""
    from . import report
    from .campaigns import CAMPAIGNS
    from .service import Service
    from .state import State

    parser = argparse.ArgumentParser(prog="python -m benchmarks.campaign", description="Attack a running service.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(CAMPAIGNS)}; all without; or replay")
    parser.add_argument("--size", default="campaign", help="ci, campaign, or a number (default campaign)")
    parser.add_argument("--seed", type=int, default=1, help="what the random requests depend on (default 1)")
    parser.add_argument("--fresh", action="store_true", help="begin anew; by default a killed run goes on")
    parser.add_argument("--out", type=Path, default=Path("build/campaign"), help="folder for state and report")
    asked = parser.parse_args(arguments)
    _fast()
    if asked.names[:1] == ["replay"]:
        return _replay(asked.names[1:], asked.out)
    unknown = [name for name in asked.names if name not in CAMPAIGNS]
    if unknown or not (asked.size in ("ci", "campaign") or asked.size.isdigit()):
        parser.error(f"unknown: {', '.join(unknown) or asked.size}")
    folder: Path = asked.out.absolute()
    states = []
    with Service(folder) as service:
        for name in asked.names or CAMPAIGNS:
            module = CAMPAIGNS[name]
            size = module.SIZES[asked.size] if asked.size in module.SIZES else int(asked.size)
            state = State.open(name, size, asked.seed, folder, asked.fresh)
            states.append(state)
            if state.complete and state.figures:
                print(f"{name}: was run before; --fresh runs it again", file=sys.stderr, flush=True)
                continue
            print(f"{name}: {state.done:,} of {size:,} {module.UNIT} are done", file=sys.stderr, flush=True)
            try:
                module.run(service, size, asked.seed, state)
            except Exception as error:  # the others shall run all the same
                state.fail(f"the campaign itself failed: {type(error).__name__}: {error}", seed=asked.seed)
                _tell(error)
                service.restart()
            finally:
                state.save()
                report.write(folder)
            told = "good" if state.good else f"NOT good: {state.failed} failures"
            print(f"{name}: {state.done:,} {module.UNIT} in {state.seconds:.0f} s, {told}", file=sys.stderr, flush=True)
    print(report.write(folder))
    return 0 if all(state.good for state in states) else 1


def _tell(error: Exception) -> None:
    import traceback

    traceback.print_exception(error)


def _replay(files: list[str], out: Path) -> int:
    """Send each file's bytes on a connection of its own to a new service; tell the answers and what is wrong."""
    from .fuzz import document
    from .service import Service
    from .verdict import Verdict
    from .wire import Ask, ask

    wrong = 0
    with Service(out.absolute() / "replay") as service:
        verdict = Verdict(asyncio.run(document(service)))
        for file in files:
            raw = Path(file).read_bytes()
            verb, path, *_ = [word.decode("latin-1") for word in raw.split(b"\r\n", 1)[0].split(b" ")] + ["", ""]
            reply = asyncio.run(ask(service.port, raw, head=verb == "HEAD", patience=75.0))
            print(f"{file}: {reply.status or reply.broken} after {reply.seconds:.3f} s")
            print("\n".join(f"{name}: {value}" for name, value in reply.headers.items()))
            print(reply.body[:2000].decode(errors="replace"))
            faults = verdict.faults(Ask(raw, verb, path, patient=True), reply)
            wrong += bool(faults)
            print(*(f"WRONG: {fault}" for fault in faults), sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
