"""A mesh as two arrays, and what the attacks ask about one."""

from typing import NamedTuple

import numpy


class Refused(Exception):
    """An attack that can't be made, in words for whoever asked for it."""


class Mesh(NamedTuple):
    """Positions (#V by 3, doubles) and triangles (#F by 3, vertices from 0). Vertices that no triangle uses are allowed."""

    positions: numpy.ndarray
    faces: numpy.ndarray

    def checked(self) -> "Mesh":
        """This mesh, if it is one."""
        if len(self.faces) == 0:
            raise Refused("no triangle is left")
        if not numpy.isfinite(self.positions).all():
            raise Refused("a coordinate is not finite")
        if self.faces.min() < 0 or self.faces.max() >= len(self.positions):
            raise Refused("a triangle names a vertex that there is not")
        return self

    def used(self) -> numpy.ndarray:
        """Whether a triangle uses each vertex, #V."""
        used = numpy.zeros(len(self.positions), dtype=bool)
        used[self.faces] = True
        return used

    def compacted(self) -> "Mesh":
        """Without the vertices that no triangle uses."""
        used = self.used()
        number = numpy.cumsum(used) - 1
        return Mesh(self.positions[used], number[self.faces])

    def half_edges(self) -> numpy.ndarray:
        """Start and end of each triangle's sides, 3 #F by 2: side k of triangle f, from its corner k to the next, is at 3 f + k."""
        return numpy.stack([self.faces, numpy.roll(self.faces, -1, axis=1)], axis=2).reshape(-1, 2)

    def edges(self) -> tuple[numpy.ndarray, numpy.ndarray]:
        """The edges (#E by 2, smaller vertex first, sorted), and which edge each half-edge runs along (3 #F)."""
        ends = numpy.sort(self.half_edges(), axis=1).astype(numpy.int64)
        keys, along = numpy.unique(ends[:, 0] * len(self.positions) + ends[:, 1], return_inverse=True)
        return numpy.stack(numpy.divmod(keys, len(self.positions)), axis=1), along

    def boundary(self) -> numpy.ndarray:
        """The edges with one triangle, #B by 2."""
        edges, along = self.edges()
        return edges[numpy.bincount(along, minlength=len(edges)) == 1]

    def edge_lengths(self) -> numpy.ndarray:
        """Of each triangle's sides, 3 #F: edges between two triangles count twice."""
        start, end = self.half_edges().T
        return numpy.linalg.norm(self.positions[end] - self.positions[start], axis=1)

    def diagonal(self) -> float:
        """Of the bounding box."""
        return float(numpy.linalg.norm(numpy.ptp(self.positions, axis=0)))

    def neighbour_means(self, edges: numpy.ndarray) -> numpy.ndarray:
        """The mean position of the other ends of the edges at each vertex, #V by 3; its own where it has none."""
        start, end = numpy.concatenate([edges, edges[:, ::-1]]).T
        count = len(self.positions)
        degree = numpy.bincount(start, minlength=count)
        sums = [numpy.bincount(start, weights=x[end], minlength=count) for x in self.positions.T]
        means = numpy.stack(sums, axis=1) / numpy.maximum(degree, 1)[:, None]
        return numpy.where(degree[:, None] > 0, means, self.positions)
