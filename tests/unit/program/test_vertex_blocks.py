"""The 3×3 blocks that precondition the linear solves."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from meshcone.program.coupled_blocks import coupled_blocks
from meshcone.program.relaxation import preconditioner
from meshcone.program.vertex_blocks import CongruenceBlocks, VertexBlocks


def some_blocks(count: int = 7) -> VertexBlocks:
    draw = np.random.default_rng(0)
    normals = draw.normal(size=(count, 3))
    return VertexBlocks.of_planes(draw.uniform(1, 2, count), normals, tangential=0.1)


def test_a_plane_is_stiff_across_and_soft_along():
    block = VertexBlocks.of_planes(np.array([2.0]), np.array([[0.0, 0, 1]]), 0.1).full()[0]

    np.testing.assert_allclose(block, np.diag([0.2, 0.2, 2.2]))


def test_the_inverse_times_the_block_is_the_identity():
    blocks = some_blocks()

    product = blocks.full() @ blocks.inverse().full()

    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=1e-12)


def test_the_preconditioner_divides_each_vertex_by_its_block():
    blocks, x = some_blocks(), np.random.default_rng(2).normal(size=21)

    found = preconditioner(blocks) @ x

    expected = np.linalg.solve(blocks.full(), x.reshape(-1, 3, 1)).ravel()
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_sums_are_those_of_the_matrices():
    blocks = some_blocks()

    total = (blocks + blocks).plus_isotropic(np.ones(7))

    np.testing.assert_allclose(total.full(), 2 * blocks.full() + np.eye(3))


def test_coupled_blocks_are_the_product_over_all_coordinates():
    draw = np.random.default_rng(2)
    factor = sparse.random_array((7, 5), density=0.5, rng=draw, format="csr")
    weights = some_blocks()

    product = coupled_blocks(factor, weights)

    spread = np.kron(factor.toarray(), np.eye(3))
    whole = spread.T @ sparse.block_diag(list(weights.full())).toarray() @ spread
    np.testing.assert_allclose(product.toarray(), whole, atol=1e-12)
    assert product.has_sorted_indices


def test_the_blocks_of_a_congruence_are_those_on_its_diagonal():
    draw = np.random.default_rng(1)
    A = sparse.random_array((20, 12), density=0.2, rng=draw, format="csr")
    pattern = sparse.random_array((20, 20), density=0.3, rng=draw, format="csr")
    pattern = sparse.csr_array(pattern + pattern.T)

    blocks = CongruenceBlocks(A, pattern).of(pattern).full()

    whole = (A.T @ pattern @ A).toarray()
    for vertex, block in enumerate(blocks):
        here = slice(3 * vertex, 3 * vertex + 3)
        np.testing.assert_allclose(block, whole[here, here], atol=1e-12)
