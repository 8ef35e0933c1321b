"""Exchange with finite element and measurement programs: import, checks, export."""

from sdm_core.blade.exchange.findings import Finding, Findings
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
