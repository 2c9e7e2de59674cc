"""√3 subdivision (Kobbelt, √3-subdivision, SIGGRAPH 2000)."""

import numpy

from mesh import Mesh
from strength import Strength

STRENGTH = Strength(default=1, lowest=1, highest=4, whole=True)

# Edges are flipped between two triangles.
NEEDS_MANIFOLD_EDGES = True


def apply(mesh: Mesh, strength: float, random: numpy.random.Generator) -> Mesh:
    """`strength` times every triangle in three. Boundaries change in every second step, where each of their edges becomes three. Not random."""
    for step in range(int(strength)):
        mesh = once(mesh, with_boundary=step % 2 == 1)
    return mesh


def once(mesh: Mesh, with_boundary: bool) -> Mesh:
    """A vertex in each triangle, the old edges flipped, the old vertices smoothed.

    With the boundary: a triangle there gets no vertex inside, but two on its side on the boundary. The step before has left
    each such triangle only one.
    """
    start, end = mesh.half_edges().T.astype(numpy.int64)
    face = numpy.repeat(numpy.arange(len(mesh.faces)), 3)
    opposite = opposites(start, end, len(mesh.positions))
    on_boundary = opposite < 0
    sides = numpy.flatnonzero(on_boundary)
    split = sides if with_boundary else sides[:0]

    # The vertices: the old, one in each triangle (unused where its boundary is split), two on each split side.
    centre = len(mesh.positions) + face
    thirds = len(mesh.positions) + len(mesh.faces) + numpy.arange(2 * len(split)).reshape(-1, 2)
    old, on_split = smoothed(mesh, start[sides], end[sides], split=with_boundary)
    inside = mesh.positions[mesh.faces].mean(axis=1)
    positions = numpy.concatenate([old, inside, on_split])
    # Where a triangle's side on the boundary is split, the third next to an inner side is that side's centre.
    following, preceding = (3 * face[split] + (split + turn) % 3 for turn in (1, 2))
    centre[following], centre[preceding] = thirds[:, 1], thirds[:, 0]

    inner = numpy.flatnonzero(~on_boundary)
    flipped = numpy.stack([centre[inner], start[inner], centre[opposite[inner]]], axis=1)
    if with_boundary:
        rest = numpy.stack([thirds[:, 0], thirds[:, 1], start[preceding]], axis=1)
    else:
        rest = numpy.stack([start[sides], end[sides], centre[sides]], axis=1)
    return Mesh(positions, numpy.concatenate([flipped, rest])).compacted()


def opposites(start: numpy.ndarray, end: numpy.ndarray, vertices: int) -> numpy.ndarray:
    """The half-edge that runs the other way along each, −1 where there is none or more than one."""
    keys, first, counts = numpy.unique(start * vertices + end, return_index=True, return_counts=True)
    backward = end * vertices + start
    place = numpy.minimum(numpy.searchsorted(keys, backward), len(keys) - 1)
    alone = counts[numpy.searchsorted(keys, start * vertices + end)] == 1
    found = (keys[place] == backward) & (counts[place] == 1) & alone
    return numpy.where(found, first[place], -1)


def smoothed(mesh: Mesh, start: numpy.ndarray, end: numpy.ndarray, split: bool) -> tuple[numpy.ndarray, numpy.ndarray]:
    """The old vertices where they come to lie, and the two new ones on each boundary half-edge from `start` to `end` if these are split.

    Inside, p' = (1 − α_n) p + α_n · mean of the n neighbours, α_n = (4 − 2 cos(2π/n)) / 9. On a boundary … p₋ p p₊ …, which is a
    cubic B-spline's control polygon, p' = (4 p₋ + 19 p + 4 p₊) / 27, with (p₋ + 16 p + 10 p₊) / 27 next to it on the way to p₊.
    """
    edges, _ = mesh.edges()
    degree = numpy.bincount(edges.ravel(), minlength=len(mesh.positions))
    weight = (4 - 2 * numpy.cos(2 * numpy.pi / numpy.maximum(degree, 1))) / 9
    positions = mesh.positions + weight[:, None] * (mesh.neighbour_means(edges) - mesh.positions)
    positions[start], positions[end] = mesh.positions[start], mesh.positions[end]
    if not split:
        return positions, numpy.empty((0, 3))
    # Before and after each vertex on the boundary; a vertex where two boundaries touch is a corner, and stays.
    count = len(mesh.positions)
    after, before = numpy.arange(count), numpy.arange(count)
    after[start], before[end] = end, start
    smooth = (numpy.bincount(start, minlength=count) == 1) & (numpy.bincount(end, minlength=count) == 1)
    p, here = mesh.positions, numpy.flatnonzero(smooth)
    positions[here] = (4 * p[before[here]] + 19 * p[here] + 4 * p[after[here]]) / 27

    def third(of: numpy.ndarray, towards: numpy.ndarray, away: numpy.ndarray) -> numpy.ndarray:
        beyond = numpy.where(smooth[of][:, None], p[away[of]], 2 * p[of] - p[towards])
        return (beyond + 16 * p[of] + 10 * p[towards]) / 27

    both = numpy.stack([third(start, end, before), third(end, start, after)], axis=1)
    return positions, both.reshape(-1, 3)
