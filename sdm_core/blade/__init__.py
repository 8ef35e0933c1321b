"""Where natural frequencies, damping and tip mode shapes come from."""

from sdm_core.blade.blade_file import (
    EXAMPLES,
    SCHEMA,
    blade_from_dict,
    blade_to_dict,
    example_blade,
    read_blade,
    write_blade,
)
from sdm_core.blade.modal import Blade, ModalState

__all__ = [
    "EXAMPLES",
    "SCHEMA",
    "Blade",
    "ModalState",
    "blade_from_dict",
    "blade_to_dict",
    "example_blade",
    "read_blade",
    "write_blade",
]
