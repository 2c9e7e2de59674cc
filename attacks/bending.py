"""What stretch, twist and bend have in common: the model along its longest axis."""

import numpy

from mesh import Mesh


def along_longest_axis(mesh: Mesh) -> tuple[numpy.ndarray, numpy.ndarray, list[int]]:
    """Positions around the centre of the bounding box, how far each lies along the longest edge (from −1/2 to 1/2), and the axes: that one first."""
    lowest, highest = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    size = highest - lowest
    axis = int(numpy.argmax(size))
    centred = mesh.positions - (lowest + highest) / 2
    share = centred[:, axis] / (size[axis] if size[axis] > 0 else 1)
    return centred, share, [axis, (axis + 1) % 3, (axis + 2) % 3]
