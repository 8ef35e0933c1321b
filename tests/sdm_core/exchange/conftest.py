"""A clamped titanium beam of hexahedra turning about z: full and reduced, at rest and at speed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import linalg
from scipy.sparse import csc_array, lil_array

from sdm_core.blade import Blade
from sdm_core.blade.matrix_model import DofMap, MatrixModel, SpeedState
from sdm_core.blade.tip_line import TipLine
from sdm_core.errors import InvalidInput

E, NU, RHO = 108e9, 0.34, 4400.0
LENGTH, WIDTH, THICKNESS, HUB = 0.06, 0.02, 0.003, 0.15
ELEMENTS = (8, 2, 1)
SPEEDS_HZ = (0.0, 180.0)
AXIS = (0.0, 0.0, 1.0)


@pytest.fixture(scope="session")
def full_model() -> MatrixModel:
    """144 degrees of freedom, sparse, with static displacements at speed."""
    nx, ny, nz = ELEMENTS
    h = np.array([LENGTH / nx, WIDTH / ny, THICKNESS / nz])
    count = (nx + 1) * (ny + 1) * (nz + 1)

    def number(i: int, j: int, k: int) -> int:
        return (i * (ny + 1) + j) * (nz + 1) + k

    # Radial along x, the chord along y; turned a little so that no coordinate is round.
    turn = np.array([[np.cos(0.3), -np.sin(0.3), 0], [np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    place = np.array(
        [
            [HUB + i * h[0], j * h[1] - WIDTH / 2, k * h[2]]
            for i in range(nx + 1)
            for j in range(ny + 1)
            for k in range(nz + 1)
        ]
    )
    stiffness, mass, geometric = element_matrices(h)
    k0, m, kg = (lil_array((3 * count, 3 * count)) for _ in range(3))
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    for i in range(nx):
        x = HUB + (i + 0.5) * h[0]
        tension = RHO / 2 * ((HUB + LENGTH) ** 2 - x**2)  # over Ω²
        for j in range(ny):
            for k in range(nz):
                nodes = [number(i + a, j + b, k + c) for a, b, c in corners]
                rows = np.ravel([[3 * n, 3 * n + 1, 3 * n + 2] for n in nodes])
                at = np.ix_(rows, rows)
                k0[at] += stiffness
                m[at] += mass
                kg[at] += tension * geometric
    free = np.arange(3 * (ny + 1) * (nz + 1), 3 * count)
    k0, m, kg = (csc_array(a)[free][:, free] for a in (k0, m, kg))
    r = linalg.block_diag(*[turn] * (len(free) // 3))
    k0, m, kg = (
        csc_array(np.where(abs(x := r @ a.toarray() @ r.T) > 1e-9 * abs(x).max(), x, 0)) for a in (k0, m, kg)
    )
    k0, m, kg = ((a + a.T) / 2 for a in (k0, m, kg))
    spin = csc_array(np.diag(np.tile([1.0, 1.0, 0.0], len(free) // 3)))
    node = np.repeat(np.arange((ny + 1) * (nz + 1), count) + 101, 3)
    place = place @ turn.T
    states = []
    for speed in SPEEDS_HZ:
        omega2 = (2 * np.pi * speed) ** 2
        k = csc_array(k0 + omega2 * (kg - (spin @ m @ spin)))
        k = csc_array((k + k.T) / 2)
        load = omega2 * (m @ np.ravel(place[(ny + 1) * (nz + 1) :] * [1, 1, 0]))
        states.append(SpeedState(speed, k, np.linalg.solve(k.toarray(), load) if speed else None))
    return MatrixModel(
        "titanium beam",
        DofMap(node, np.tile([1, 2, 3], len(free) // 3)),
        csc_array(m),
        tuple(states),
        {n + 101: tuple(map(float, p)) for n, p in enumerate(place)},
        AXIS,
    )


def element_matrices(h: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness, mass and ∫ ∂N/∂x ∂N/∂x of a brick with eight nodes, (24, 24) each."""
    signs = np.array(
        [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
    )
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    c = np.diag([2 * mu] * 3 + [mu] * 3)
    c[:3, :3] += lam
    g = 1 / np.sqrt(3)
    volume = h.prod() / 8
    stiffness, mass, geometric = np.zeros((24, 24)), np.zeros((24, 24)), np.zeros((24, 24))
    for point in signs * g:
        f = (1 + signs * point) / 2
        n = f.prod(axis=1)
        d = np.stack([signs[:, a] / h[a] * np.delete(f, a, axis=1).prod(axis=1) for a in range(3)], axis=1)
        b = np.zeros((6, 24))
        for a in range(3):
            b[a, a::3] = d[:, a]
        for row, (p, q) in enumerate(((0, 1), (1, 2), (2, 0)), 3):
            b[row, p::3], b[row, q::3] = d[:, q], d[:, p]
        stiffness += b.T @ c @ b * volume
        mass += RHO * np.kron(np.outer(n, n), np.eye(3)) * volume
        geometric += np.kron(np.outer(d[:, 0], d[:, 0]), np.eye(3)) * volume
    return stiffness, mass, geometric


@pytest.fixture(scope="session")
def tip(full_model: MatrixModel) -> TipLine:
    """The outer edge on the pressure side, three nodes; contact along the radius."""
    last = sorted(full_model.node_position_m)[-6::2]
    out = full_model.positions(last) * [1, 1, 0]
    return TipLine(("LE", "MC", "TE"), last, out, "radial")


@pytest.fixture(scope="session")
def reduced_model(full_model: MatrixModel, tip: TipLine) -> MatrixModel:
    """Tip nodes kept, twelve fixed-interface modes: 21 rows, dense ([SBL] Eq. 15)."""
    model = full_model
    b = model.dofs.rows(tip.nodes).ravel()
    i = np.setdiff1d(np.arange(len(model.dofs)), b)
    k, m = model.states[0].stiffness.toarray(), model.mass.toarray()
    static = -np.linalg.solve(k[np.ix_(i, i)], k[np.ix_(i, b)])
    _, phi = linalg.eigh(k[np.ix_(i, i)], m[np.ix_(i, i)], subset_by_index=(0, 11))
    t = np.zeros((len(model.dofs), len(b) + 12))
    t[b, : len(b)] = np.eye(len(b))
    t[i, : len(b)], t[i, len(b) :] = static, phi

    def projected(a):
        a = t.T @ (a @ t)
        return (a + a.T) / 2

    dofs = DofMap(
        np.concatenate((np.repeat(tip.nodes, 3), np.zeros(12, int))),
        np.concatenate((np.tile([1, 2, 3], 3), np.zeros(12, int))),
    )
    return MatrixModel(
        "reduced beam",
        dofs,
        projected(model.mass),
        tuple(SpeedState(s.speed_hz, projected(s.stiffness)) for s in model.states),
        {node: model.node_position_m[node] for node in tip.nodes},
        AXIS,
    )


@pytest.fixture(scope="session")
def blade(full_model: MatrixModel, tip: TipLine) -> Blade:
    """Modal data of the beam: five modes at two speeds, with all that a blade file can hold."""
    return full_model.to_blade(
        tip,
        damping_ratio=[1e-3, 1.5e-3, 2e-3, 1e-3, 3e-3],
        modes=5,
        mass_kg=0.0158,
        design_speed_hz=180.0,
        material={"rho": RHO, "E": E},
    )


@pytest.fixture
def refused(capfd: pytest.CaptureFixture[str]) -> Callable[..., InvalidInput]:
    """Reads files that must be refused: one error that says all the words, and nothing printed."""

    def check(read: Callable, files, *words: str) -> InvalidInput:
        with pytest.raises(InvalidInput) as caught:
            read(files)
        text = str(caught.value)
        for word in words:
            assert word in text, text
        assert caught.value.remedy
        assert len(text) < 600
        assert capfd.readouterr() == ("", "")
        return caught.value

    return check
