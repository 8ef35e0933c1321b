"""The shape of a blade: sections from parameters or from a table, and the solid between them."""

from sdm_core.blade.profile.blade_profile import BladeProfile
from sdm_core.blade.profile.parametric import ParametricBlade
from sdm_core.blade.profile.profile_file import (
    EXAMPLE_PROFILES,
    SCHEMA,
    example_profile_document,
    profile_from_dict,
    profile_to_dict,
    read_profile,
)
from sdm_core.blade.profile.sections import SectionTable, read_sections

__all__ = [
    "EXAMPLE_PROFILES",
    "SCHEMA",
    "BladeProfile",
    "ParametricBlade",
    "SectionTable",
    "example_profile_document",
    "profile_from_dict",
    "profile_to_dict",
    "read_profile",
    "read_sections",
]
