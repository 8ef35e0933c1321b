"""Where torch computes: on a GPU when there is one."""

from __future__ import annotations

import os

import torch

from sdm_core.errors import InvalidInput


def chosen_device(name: str = "auto") -> torch.device:
    """The device of a name; ``auto`` is a GPU when there is one, else the CPU.

    Raises
    ------
    InvalidInput
        For a device that is not there.

    Examples
    --------
    >>> chosen_device("cpu")
    device(type='cpu')
    """
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        raise InvalidInput("device", name, "use auto, cpu, or cuda where there is one") from error
    if device.type == "cuda":  # what cuBLAS needs to give the same figures twice
        os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    return device
