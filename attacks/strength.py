"""How much of an attack."""

from typing import NamedTuple

from mesh import Refused


class Strength(NamedTuple):
    """What an attack's number may be: from `lowest` to `highest`, both included."""

    default: float
    lowest: float
    highest: float
    whole: bool = False

    def checked(self, value: float | None) -> float:
        """The number, or the default without one."""
        if value is None:
            return self.default
        if not self.lowest <= value <= self.highest:
            raise Refused(f"strength {value:g} is not from {self.lowest:g} to {self.highest:g}")
        if self.whole and value != int(value):
            raise Refused(f"strength {value:g} is not a whole number")
        return value
