"""The campaigns, by name, in the order in which they run: those that leave the service alone come first."""

from types import ModuleType

from . import endings, fuzz, half_open, hangs, hostile, kills, memory, overload, same_bytes

CAMPAIGNS: dict[str, ModuleType] = {
    "hostile": hostile,
    "fuzz": fuzz,
    "memory": memory,
    "half_open": half_open,
    "overload": overload,
    "kills": kills,
    "hangs": hangs,
    "same_bytes": same_bytes,
    "endings": endings,
}
