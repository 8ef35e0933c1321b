"""Exchange with finite element and measurement programs: import, checks, export.

The front doors are `reading` and `writing`, for the formats listed in `formats`. Matrices go from a file to
its `content`, get their `roles`, and become one model in SI by `units` and `assembly`. Below them, by
subject:

================  ======================================================================
``nastran``       OUTPUT4, DMIG, and the bulk data beside it
``universal``     universal files (UFF, .unv)
``named_arrays``  MATLAB and NumPy archives
``tables``        CSV
``triplets``      CalculiX and Matrix Market
``checks``        what imported data are checked for, and the findings
``parsing``       bytes, lines and numbers of a file, whatever its format
================  ======================================================================
"""

from sdm_core.blade.exchange.checks.findings import Finding, Findings
from sdm_core.blade.exchange.formats import FORMATS, Format
from sdm_core.blade.exchange.reading import MatrixImport, ModalImport, read_matrix_model, read_modal
from sdm_core.blade.exchange.writing import Written, export_blade, write_model

__all__ = [
    "FORMATS",
    "Finding",
    "Findings",
    "Format",
    "MatrixImport",
    "ModalImport",
    "Written",
    "export_blade",
    "read_matrix_model",
    "read_modal",
    "write_model",
]
