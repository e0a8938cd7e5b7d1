"""The public surface: a change of a name or a signature is seen, and made on purpose.

After such a change: python tests/project/test_surface.py > tests/project/surface.txt, and a line
in CHANGELOG.md.
"""

import inspect
from pathlib import Path

import pytest

import wgmb
import wgmb.scene

pytestmark = pytest.mark.fast

STORED = Path(__file__).with_name("surface.txt")


def _signature(name: str, found: object) -> str:
    try:
        signature = inspect.signature(found)  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError):
        return name
    plain = [
        p.replace(default=...) if " at 0x" in repr(p.default) or "factory" in repr(p.default) else p
        for p in signature.parameters.values()
    ]
    return f"{name}{signature.replace(parameters=plain)}"


def surface() -> str:
    """Every exported name with its signature, its public methods and its fields."""
    lines = []
    exported = {name: getattr(wgmb, name) for name in wgmb.__all__}
    exported |= {f"scene.{name}": getattr(wgmb.scene, name) for name in wgmb.scene.__all__}
    for name, found in sorted(exported.items()):
        if not callable(found):
            lines.append(f"{name}: {', '.join(sorted(found))}")
            continue
        lines.append(_signature(name, found))
        if not inspect.isclass(found) or issubclass(found, Exception):
            continue
        own = vars(found)
        fields = getattr(found, "__dataclass_fields__", ())
        for member in sorted(own):
            if (member.startswith("_") and member != "__call__") or member in fields:
                continue
            made = inspect.getattr_static(found, member)
            if isinstance(made, property) or not callable(getattr(found, member)):
                lines.append(f"    {member}")
            else:
                lines.append(f"    {_signature(member, getattr(found, member))}")
    return "\n".join(lines) + "\n"


def test_the_public_surface_is_as_it_was_written_down():
    assert surface() == STORED.read_text()


if __name__ == "__main__":
    print(surface(), end="")
