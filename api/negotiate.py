"""Which format the answer comes in (RFC 9110, section 12.5.1)."""

from functools import lru_cache

from .errors import Refusal


@lru_cache(maxsize=512)
def choose(accept: str | None, available: tuple[str, ...]) -> str:
    """Return the available media type that the ``Accept`` header prefers; the first one if it does not care.

    Of equal quality, the type that was named more exactly wins, then the earlier one of ``available``.

    Raises
    ------
    Refusal
        ``not_acceptable``, with the list of what is available.
    """
    ranges = _ranges(accept or "*/*")
    best, best_rank = None, (0.0, 0)
    for offer in available:
        matching = [(specificity, q) for name, q in ranges if (specificity := _specificity(name, offer)) > 0]
        if not matching:
            continue
        specificity, q = max(matching)
        if q > 0 and (q, specificity) > best_rank:
            best, best_rank = offer, (q, specificity)
    if best is None:
        detail = f"none of the formats asked for is available; these are: {', '.join(available)}"
        raise Refusal("not_acceptable", detail, {"available": list(available)})
    return best


def _ranges(accept: str) -> list[tuple[str, float]]:
    """Return the media ranges with their qualities; what cannot be read is left out."""
    found = []
    for part in accept[:4000].split(","):
        name, *parameters = (piece.strip().lower() for piece in part.split(";"))
        quality = 1.0
        for parameter in parameters:
            key, _, value = parameter.partition("=")
            if key.strip() == "q":
                try:
                    quality = float(value)
                except ValueError:
                    quality = 0.0
        if name:
            found.append((name, quality if 0.0 <= quality <= 1.0 else 0.0))
    return found


def _specificity(name: str, offer: str) -> int:
    """Return 3 for the type itself, 2 for ``type/*``, 1 for ``*/*``, 0 if the range does not hold the type."""
    if name == offer:
        return 3
    if name == "*/*":
        return 1
    return 2 if name.endswith("/*") and offer.startswith(name[:-1]) else 0
