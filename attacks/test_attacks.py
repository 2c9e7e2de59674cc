"""Each attack does what it is named for: python -m unittest discover -s attacks."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy

import chain
import repair
import simplify
from mesh import Mesh, Refused
from meshfile import load, save

HERE = pathlib.Path(__file__).parent


def grid(rows: int, columns: int, wrap: bool) -> numpy.ndarray:
    """The triangles of a grid of vertices; joined to a torus if it wraps."""
    number = numpy.arange(rows * columns).reshape(rows, columns)
    if wrap:
        number = numpy.pad(number, (0, 1), mode="wrap")
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    return numpy.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def torus(rows: int = 48, columns: int = 32) -> Mesh:
    """Radii 1 and 0.4, bumpy so that no vertex is like another, turned outwards."""
    u, v = numpy.meshgrid(
        2 * numpy.pi * numpy.arange(rows) / rows, 2 * numpy.pi * numpy.arange(columns) / columns, indexing="ij"
    )
    tube = 0.4 * (1 + 0.1 * numpy.sin(3 * u + 1) * numpy.cos(2 * v))
    around = 1 + tube * numpy.cos(v)
    points = numpy.stack([around * numpy.cos(u), around * numpy.sin(u), tube * numpy.sin(v)], axis=-1)
    return Mesh(points.reshape(-1, 3), grid(rows, columns, wrap=True))


def sheet(rows: int = 20, columns: int = 16) -> Mesh:
    """A flat rectangle with a boundary."""
    x, y = numpy.meshgrid(numpy.arange(rows) / 10, numpy.arange(columns) / 10, indexing="ij")
    return Mesh(numpy.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), grid(rows, columns, wrap=False))


def icosphere(steps: int) -> Mesh:
    """The unit sphere, by splitting an icosahedron's triangles."""
    golden = (1 + 5**0.5) / 2
    corners = [
        (s * a, t * b, 0) for s in (-1, 1) for t in (-1, 1) for a, b in [(1, golden)]
    ]
    points = numpy.array([numpy.roll(p, k) for k in range(3) for p in corners], dtype=float)
    near = numpy.linalg.norm(points[:, None] - points[None], axis=2) < 2.1
    faces = [
        (i, j, k) if numpy.linalg.det(points[[i, j, k]]) > 0 else (i, k, j)
        for i in range(12) for j in range(i) for k in range(j)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    mesh = Mesh(points, numpy.array(faces))
    for _ in range(steps):
        mesh = attacked(mesh, "midpoint")
    return Mesh(mesh.positions / numpy.linalg.norm(mesh.positions, axis=1)[:, None], mesh.faces)


def attacked(mesh: Mesh, text: str, seed: int = 0) -> Mesh:
    return chain.run(mesh, chain.parsed(text, None), seed)[0]


def area(mesh: Mesh) -> float:
    a, b, c = (mesh.positions[mesh.faces[:, k]] for k in range(3))
    return float(numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1).sum() / 2)


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.positions[mesh.faces[:, k]] for k in range(3))
    return float((numpy.cross(a, b) * c).sum() / 6)


def degrees(mesh: Mesh) -> numpy.ndarray:
    return numpy.bincount(mesh.edges()[0].ravel(), minlength=len(mesh.positions))


def loops(mesh: Mesh) -> int:
    """How many closed curves the boundary is; each of its vertices must have two of its edges."""
    edges = mesh.boundary()
    numbers, ends = numpy.unique(edges, return_inverse=True)
    ends = ends.reshape(-1, 2)
    assert (numpy.bincount(ends.ravel()) == 2).all()
    names = numpy.arange(len(numbers))
    while True:
        least = names.copy()
        numpy.minimum.at(least, ends[:, 0], names[ends[:, 1]])
        numpy.minimum.at(least, ends[:, 1], names[ends[:, 0]])
        if (least == names).all():
            return len(numpy.unique(names))
        names = least


class AttackCase(unittest.TestCase):
    def assert_closed_and_oriented(self, mesh: Mesh) -> None:
        start, end = mesh.half_edges().T.astype(numpy.int64)
        forward, backward = (numpy.unique(a * len(mesh.positions) + b) for a, b in ((start, end), (end, start)))
        self.assertEqual(len(forward), len(start))
        numpy.testing.assert_array_equal(forward, backward)

    def assert_same_faces(self, a: Mesh, b: Mesh) -> None:
        numpy.testing.assert_array_equal(a.faces, b.faces)
        self.assertEqual(len(a.positions), len(b.positions))


class Fixtures(AttackCase):
    def test_fixtures_are_what_they_are_called(self):
        for mesh, euler in [(torus(), 0), (icosphere(2), 2)]:
            self.assert_closed_and_oriented(mesh)
            self.assertEqual(len(mesh.positions) - len(mesh.edges()[0]) + len(mesh.faces), euler)
            self.assertGreater(volume(mesh), 0)
        self.assertEqual(loops(sheet()), 1)


class Moves(AttackCase):
    """Attacks that keep the connectivity."""

    def test_similarity_scales_all_lengths_alike_and_mirrors_nothing(self):
        mesh = torus()
        scales = []
        for seed in range(20):
            moved = attacked(mesh, "similarity:10", seed)
            self.assert_same_faces(mesh, moved)
            ratios = moved.edge_lengths() / mesh.edge_lengths()
            numpy.testing.assert_allclose(ratios, ratios[0], rtol=1e-9)
            self.assertAlmostEqual(volume(moved) / volume(mesh) / ratios[0] ** 3, 1, places=6)
            scales.append(ratios[0])
        self.assertTrue(0.1 <= min(scales) < 0.5 and 2 < max(scales) <= 10)

    def test_noise_is_uniform_in_a_fraction_of_the_box(self):
        mesh = torus()
        for strength in (0.1, 0.5):
            noisy = attacked(mesh, f"noise:{strength}", 3)
            self.assert_same_faces(mesh, noisy)
            shift = (noisy.positions - mesh.positions) / (strength / 100 * numpy.ptp(mesh.positions, axis=0))
            self.assert_uniform(shift)

    def test_noise_of_the_benchmark_is_uniform_in_a_fraction_of_the_mean_distance(self):
        ball = icosphere(4)
        ball = Mesh(3 * ball.positions + [5, 0, 0], ball.faces)
        noisy = attacked(ball, "noise-liris:0.5", 3)
        self.assert_same_faces(ball, noisy)
        self.assert_uniform((noisy.positions - ball.positions) / (0.005 * 3))

    def test_noise_of_the_benchmark_leaves_boundaries(self):
        mesh = sheet()
        still = (attacked(mesh, "noise-liris:1").positions == mesh.positions).all(axis=1)
        on_boundary = numpy.zeros(len(mesh.positions), dtype=bool)
        on_boundary[mesh.boundary()] = True
        numpy.testing.assert_array_equal(still, on_boundary)

    def assert_uniform(self, shift: numpy.ndarray) -> None:
        """In −1 … 1, axis by axis: bounds, mean, deviation."""
        self.assertLessEqual(numpy.abs(shift).max(), 1 + 1e-9)
        self.assertTrue((numpy.abs(shift).max(axis=0) > 0.98).all())
        self.assertTrue((numpy.abs(shift.mean(axis=0)) < 0.06).all())
        numpy.testing.assert_allclose(shift.std(axis=0), 3**-0.5, rtol=0.06)

    def test_a_step_of_laplacian_smoothing_moves_each_vertex_towards_the_mean_of_its_neighbours(self):
        mesh = torus()
        edges, _ = mesh.edges()
        means = mesh.neighbour_means(edges)
        n = degrees(mesh)[:, None]
        numpy.testing.assert_allclose(
            attacked(mesh, "laplacian:1").positions, (mesh.positions + 2 * n * means) / (1 + 2 * n), atol=1e-12
        )
        numpy.testing.assert_allclose(
            attacked(mesh, "laplacian-liris:1").positions, 0.9 * mesh.positions + 0.1 * means, atol=1e-12
        )

    def test_smoothing_smooths_and_only_taubin_keeps_the_volume(self):
        smooth = icosphere(4)
        noisy = attacked(smooth, "noise:0.5", 1)

        def roughness(mesh: Mesh) -> float:
            radii = numpy.linalg.norm(mesh.positions, axis=1)
            return float(radii.std())

        kept = {}
        for text in ("laplacian:5", "laplacian-liris:50", "taubin:10"):
            after = attacked(noisy, text)
            self.assert_same_faces(noisy, after)
            self.assertLess(roughness(after), 0.6 * roughness(noisy), text)
            kept[text] = volume(after) / volume(noisy)
        self.assertLess(abs(kept["taubin:10"] - 1), 0.005)
        self.assertTrue(kept["laplacian:5"] < 0.99 and kept["laplacian-liris:50"] < 0.99, kept)

    def test_no_steps_of_smoothing_change_nothing(self):
        for name in ("laplacian", "laplacian-liris", "taubin"):
            numpy.testing.assert_array_equal(attacked(torus(), f"{name}:0").positions, torus().positions)

    def test_smoothing_of_the_benchmark_leaves_boundaries(self):
        mesh = attacked(sheet(), "noise:1", 2)
        after = attacked(mesh, "laplacian-liris:5")
        numpy.testing.assert_array_equal(after.positions[mesh.boundary()], mesh.positions[mesh.boundary()])

    def test_quantised_coordinates_have_so_many_values_and_move_by_half_a_step_at_most(self):
        mesh = attacked(torus(96, 64), "similarity:1", 4)
        size = numpy.ptp(mesh.positions, axis=0)
        for bits in range(7, 15):
            after = attacked(mesh, f"quantise:{bits}")
            self.assert_same_faces(mesh, after)
            shift = numpy.abs(after.positions - mesh.positions)
            self.assertTrue((shift <= size / (2**bits - 1) / 2 * (1 + 1e-9)).all())
            numpy.testing.assert_allclose(numpy.ptp(after.positions, axis=0), size, rtol=1e-12)
            for values in after.positions.T:
                self.assertLessEqual(len(numpy.unique(values)), 2**bits)
            self.assertGreater(len(numpy.unique(after.positions[:, 2])), 100)
        flat = attacked(sheet(), "quantise:7")
        self.assertTrue((flat.positions[:, 2] == 0).all())

    def test_bending_keeps_what_it_should(self):
        mesh = attacked(torus(96, 64), "similarity:1", 4)
        centred = mesh.positions - (mesh.positions.min(axis=0) + mesh.positions.max(axis=0)) / 2
        size = numpy.ptp(centred, axis=0)
        axis = int(numpy.argmax(size))
        across = [other for other in range(3) if other != axis]

        stretched = attacked(mesh, "stretch:2")
        numpy.testing.assert_allclose(numpy.ptp(stretched.positions, axis=0)[axis], 1.02 * size[axis])
        numpy.testing.assert_allclose(stretched.positions[:, across], centred[:, across])

        twisted = attacked(mesh, "twist:5")
        numpy.testing.assert_allclose(twisted.positions[:, axis], centred[:, axis])
        numpy.testing.assert_allclose(
            numpy.linalg.norm(twisted.positions[:, across], axis=1), numpy.linalg.norm(centred[:, across], axis=1)
        )

        # Shears and bends along an arc keep volumes: the one up to its determinant, the other by Pappus.
        affine = attacked(mesh, "affine:1", 3)
        matrix = numpy.linalg.lstsq(mesh.positions, affine.positions, rcond=None)[0]
        numpy.testing.assert_allclose(mesh.positions @ matrix, affine.positions, atol=1e-12)
        self.assertTrue(0 < numpy.abs(matrix - numpy.eye(3)).max() <= 0.01)
        self.assertAlmostEqual(volume(affine) / volume(mesh), numpy.linalg.det(matrix), places=9)
        for angle in (0, 1, 10):
            bent = attacked(mesh, f"bend:{angle}")
            self.assert_same_faces(mesh, bent)
            self.assertAlmostEqual(volume(bent) / volume(mesh), 1, delta=0.01)
        self.assertGreater(numpy.abs(attacked(mesh, "bend:10").positions - centred).max(), 0.01 * size[axis])


class Resamplings(AttackCase):
    """Attacks that change the connectivity."""

    def test_loop_splits_each_triangle_in_four_by_the_masks_of_loop(self):
        mesh = torus()
        edges, along = mesh.edges()
        after = attacked(mesh, "loop")
        self.assertEqual(len(after.positions), len(mesh.positions) + len(edges))
        self.assertEqual(len(after.faces), 4 * len(mesh.faces))
        self.assert_closed_and_oriented(after)
        n = degrees(mesh)[:, None]
        beta = 5 / 8 - (3 / 8 + numpy.cos(2 * numpy.pi / n) / 4) ** 2
        even = (1 - beta) * mesh.positions + beta * mesh.neighbour_means(edges)
        numpy.testing.assert_allclose(after.positions[: len(even)], even, atol=1e-12)
        # 3/8 of the ends, 1/8 of what lies across.
        corners = mesh.positions[mesh.faces]
        across = numpy.zeros((len(edges), 3))
        numpy.add.at(across, along, numpy.roll(corners, 1, axis=1).reshape(-1, 3))
        odd = 3 / 8 * mesh.positions[edges].sum(axis=1) + across / 8
        ours, theirs = (rows[numpy.lexsort(rows.round(5).T)] for rows in (odd, after.positions[len(even):]))
        numpy.testing.assert_allclose(theirs, ours, atol=2e-5)

    def test_midpoint_leaves_the_surface(self):
        for mesh in (torus(), sheet()):
            edges, _ = mesh.edges()
            after = attacked(mesh, "midpoint")
            self.assertEqual(len(after.positions), len(mesh.positions) + len(edges))
            self.assertEqual(len(after.faces), 4 * len(mesh.faces))
            self.assertAlmostEqual(area(after), area(mesh), places=9)
            self.assertAlmostEqual(volume(after), volume(mesh), places=9)
            self.assertEqual(len(after.boundary()), 2 * len(mesh.boundary()))
            numpy.testing.assert_array_equal(after.positions[: len(mesh.positions)], mesh.positions)

    def test_sqrt3_splits_each_triangle_in_three_and_leaves_degrees(self):
        for mesh in (torus(), icosphere(2)):
            after = attacked(mesh, "sqrt3")
            self.assertEqual(len(after.positions), len(mesh.positions) + len(mesh.faces))
            self.assertEqual(len(after.faces), 3 * len(mesh.faces))
            self.assert_closed_and_oriented(after)
            expected = numpy.concatenate([degrees(mesh), numpy.full(len(mesh.faces), 6)])
            numpy.testing.assert_array_equal(degrees(after), expected)
            self.assertGreater(volume(after), 0.9 * volume(mesh))

    def test_two_steps_of_sqrt3_split_triangles_in_nine_and_boundary_edges_in_three(self):
        mesh = sheet()
        once, twice = attacked(mesh, "sqrt3"), attacked(mesh, "sqrt3:2")
        self.assertEqual([len(once.boundary()), len(once.faces)], [len(mesh.boundary()), 3 * len(mesh.faces)])
        self.assertEqual([len(twice.boundary()), len(twice.faces)], [3 * len(mesh.boundary()), 9 * len(mesh.faces)])
        self.assertEqual(len(twice.positions) - len(twice.edges()[0]) + len(twice.faces), 1)
        self.assertEqual(loops(twice), 1)
        self.assertAlmostEqual(area(once), area(mesh), places=9)
        # Corners are rounded, straight sides stay straight, nothing folds.
        self.assertTrue(0.99 * area(mesh) < area(twice) < area(mesh))
        a, b, c = (twice.positions[twice.faces[:, k]] for k in range(3))
        self.assertEqual(len(numpy.unique(numpy.sign(numpy.cross(b - a, c - a)[:, 2]))), 1)
        inner = (numpy.abs(twice.positions[:, 0] - 0.95) < 0.5) & (twice.positions[:, 1] < 1e-9)
        self.assertGreater(inner.sum(), 20)

    def test_simplification_leaves_so_many_triangles_near_the_surface(self):
        ball = icosphere(5)
        for name in ("simplify", "simplify-meshlab"):
            for percent in (50, 30, 10, 5, 1):
                after = attacked(ball, f"{name}:{percent}")
                self.assertLess(abs(len(after.faces) / len(ball.faces) - percent / 100), 0.0002, name)
                self.assertTrue(after.used().all())
                radii = numpy.linalg.norm(after.positions, axis=1)
                self.assertLess(numpy.abs(radii - 1).max(), 12 / len(after.faces))

    def test_simplification_that_falls_short_is_refused(self):
        mesh = torus()
        self.assertIs(simplify.reached(mesh, round(len(mesh.faces) / 1.01)), mesh)
        with self.assertRaisesRegex(Refused, "wanted"):
            simplify.reached(mesh, round(len(mesh.faces) / 1.03))

    def test_crop_keeps_one_side_of_a_plane(self):
        ball = icosphere(5)
        for percent, seed in [(50, 0), (50, 1), (25, 2), (90, 3)]:
            after = attacked(ball, f"crop:{percent}", seed)
            self.assertLess(abs(len(after.positions) / len(ball.positions) - percent / 100), 0.01)
            self.assertEqual(loops(after), 1)
            self.assertTrue(after.used().all())
            whole = {p.tobytes() for p in ball.positions}
            self.assertTrue(all(p.tobytes() in whole for p in after.positions))
            # The boundary lies along a plane: its third singular value is small.
            rim = after.positions[numpy.unique(after.boundary())]
            spread = numpy.linalg.svd(rim - rim.mean(axis=0), compute_uv=False)
            self.assertLess(spread[2], 0.05 * spread[0])
        everything = attacked(ball, "crop:100")
        self.assertEqual(len(everything.faces), len(ball.faces))
        self.assertFalse(numpy.array_equal(*(attacked(ball, "crop", s).positions[:9] for s in (0, 1))))

    def test_crop_counts_vertices_that_triangles_use(self):
        mesh = torus()
        away = Mesh(numpy.concatenate([mesh.positions, numpy.full((900, 3), 50.0)]), mesh.faces)
        numpy.testing.assert_array_equal(attacked(away, "crop:40").positions, attacked(mesh, "crop:40").positions)

    def test_remeshing_makes_edges_alike_and_stays_on_the_surface(self):
        stretched = torus(160, 16)
        before = stretched.edge_lengths()
        for percent in (100, 70):
            after = attacked(stretched, f"remesh:{percent}")
            lengths = after.edge_lengths()
            self.assertLess(abs(lengths.mean() / before.mean() / (percent / 100) - 1), 0.15)
            self.assertLess(lengths.std() / lengths.mean(), 0.5 * before.std() / before.mean())
            self.assertLess(abs(area(after) / area(stretched) - 1), 0.03)

    def test_a_distance_field_gives_a_closed_surface_back_within_a_cell(self):
        mesh = torus()
        for cells in (32, 64):
            after = attacked(mesh, f"sdf:{cells}")
            self.assert_closed_and_oriented(after)
            self.assertLess(abs(volume(after) / volume(mesh) - 1), 0.02)
            cell = numpy.ptp(mesh.positions, axis=0).max() / cells
            away = numpy.abs(numpy.ptp(after.positions, axis=0) - numpy.ptp(mesh.positions, axis=0))
            self.assertLess(away.max(), 2 * cell)


    def test_what_is_made_solid_has_a_wall_on_either_side(self):
        mesh = torus()
        after = attacked(mesh, "solid:64")
        self.assert_closed_and_oriented(after)
        cell = numpy.ptp(mesh.positions, axis=0).max() / 64
        self.assertLess(abs(area(after) / (2 * area(mesh)) - 1), 0.05)
        self.assertLess(abs(volume(after) / (2 * cell * area(mesh)) - 1), 0.05)


class Chains(AttackCase):
    def test_a_chain_is_its_steps_one_after_the_other(self):
        mesh = torus()
        one_by_one = attacked(attacked(mesh, "crop:50", 7), "simplify:30", 7)
        numpy.testing.assert_array_equal(attacked(mesh, "crop:50+simplify:30", 7).positions, one_by_one.positions)

    def test_steps_draw_from_streams_of_their_own(self):
        mesh = torus()
        once, twice = (attacked(mesh, text, 7).positions - mesh.positions for text in ("noise:1", "noise:1+noise:1"))
        self.assertLess(abs(numpy.corrcoef(once.ravel(), (twice - once).ravel())[0, 1]), 0.06)

    def test_the_papers_combinations_are_chains(self):
        mesh = torus(96, 64)
        for name, text in chain.CHAINS.items():
            result, steps = chain.run(mesh, chain.parsed(name, None), 1)
            self.assertEqual(len(steps), len(text.split("+")))
            numpy.testing.assert_array_equal(result.positions, attacked(mesh, text, 1).positions)

    def test_the_list_tells_the_modules_defaults(self):
        for script in chain.LIST["script"]:
            default = chain.ATTACKS[script["name"]].STRENGTH.default
            self.assertRegex(script["strength"], rf"default {default:g}( |$)")

    def test_every_attack_of_the_tables_can_be_read(self):
        for attack in (attack for table in chain.LIST["tables"].values() for attack in table):
            self.assertEqual(len(chain.parsed(attack["spec"], None)), len(attack["spec"].split("+")))

    def test_what_decimation_breaks_is_mended_and_said(self):
        mesh = torus()
        fin = Mesh(
            numpy.concatenate([mesh.positions, [[9, 9, 9]]]),
            numpy.concatenate([mesh.faces, mesh.faces[:1], [[0, 0, 1]], [[*mesh.faces[9, :2], len(mesh.positions)]]]),
        )
        mended, removed = repair.repaired(fin)
        self.assertEqual(list(removed.values()), [1, 1, 1])
        self.assertEqual(list(removed), list(repair.REPAIRS))
        same, nothing = repair.repaired(mesh)
        self.assertIs(same, mesh)
        self.assertEqual(nothing, {})
        for name in ("loop", "sqrt3"):
            _, [report] = chain.run(fin, chain.parsed(name, None), 0)
            self.assertEqual(report["removed"], removed)
            self.assertEqual(report["faces"][1], len(mended.faces) * {"loop": 4, "sqrt3": 3}[name])

    def test_nonsense_is_refused(self):
        for text in ("", "nois", "crop:", "crop:x", "crop:0", "crop:101", "crop:nan", "loop:1.5", "crop+", "noise:-1"):
            with self.assertRaises(Refused):
                chain.parsed(text, None)
        with self.assertRaises(Refused):
            chain.parsed("crop:50+loop", 2.0)
        with self.assertRaises(Refused):
            attacked(sheet(), "crop:0.01")


class Command(AttackCase):
    """attack.py as others call it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        save(torus(), str(self.folder / "in.ply"))

    def call(self, *words: str) -> subprocess.CompletedProcess:
        command = [sys.executable, str(HERE / "attack.py"), *words]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)

    def test_saved_meshes_are_read_back_exactly(self):
        again = load(str(self.folder / "in.ply"))
        numpy.testing.assert_array_equal(again.positions, torus().positions)
        numpy.testing.assert_array_equal(again.faces, torus().faces)

    def test_every_attack_gives_the_same_bytes_again(self):
        random = {"affine", "crop", "noise", "noise-liris", "similarity"}
        for name in [*chain.ATTACKS, "crop-simplify-loop"]:
            for out, seed in [("a.ply", "5"), ("b.ply", "5"), ("c.ply", "6")]:
                done = self.call("in.ply", out, name, "--seed", seed)
                self.assertEqual(done.returncode, 0, done.stderr)
            a, b, c = ((self.folder / name).read_bytes() for name in ("a.ply", "b.ply", "c.ply"))
            self.assertEqual(a, b, name)
            self.assertEqual(a != c, name in random or "crop" in name, name)

    def test_the_report_is_one_line_that_says_what_was_done(self):
        done = self.call("in.ply", "out.ply", "crop:50+simplify:10+loop", "--seed", "5")
        [line] = done.stdout.splitlines()
        report = json.loads(line)
        result = load(str(self.folder / "out.ply"))
        self.assertEqual(report["attack"], "crop:50+simplify:10+loop:1")
        self.assertEqual(report["seed"], 5)
        self.assertEqual(report["vertices"], [len(torus().positions), len(result.positions)])
        self.assertEqual(report["faces"], [len(torus().faces), len(result.faces)])
        self.assertEqual([step["name"] for step in report["steps"]], ["crop", "simplify", "loop"])
        for before, after in zip(report["steps"], report["steps"][1:]):
            self.assertEqual(before["faces"][1], after["faces"][0])
        pinned = [line.split("==") for line in (HERE / "requirements.txt").read_text().splitlines() if "==" in line]
        self.assertEqual({name: report["versions"][name] for name, _ in pinned}, dict(pinned))

    def test_strengths_may_stand_in_the_name_or_beside_it(self):
        self.call("in.ply", "a.ply", "noise:0.5")
        self.call("in.ply", "b.ply", "noise", "--strength", "0.5")
        self.assertEqual(*((self.folder / name).read_bytes() for name in ("a.ply", "b.ply")))

    def test_what_can_not_be_done_is_said_in_one_line_and_leaves_no_file(self):
        (self.folder / "text.ply").write_text("no mesh")
        (self.folder / "points.xyz").write_text("0 0 0\n1 0 0\n")
        (self.folder / "in.txt").write_text("no mesh")
        (self.folder / "folder.ply").mkdir()
        before = sorted(self.folder.iterdir())
        for words in [
            ("none.ply", "out.ply", "noise"),
            ("text.ply", "out.ply", "noise"),
            ("points.xyz", "out.ply", "noise"),
            ("in.txt", "out.ply", "noise"),
            ("in.ply", "out.obj", "noise"),
            ("in.ply", "none/out.ply", "noise"),
            ("in.ply", "folder.ply", "noise"),
            ("in.ply", "out.ply", "nois"),
            ("in.ply", "out.ply", "crop:0.01"),
            ("in.ply", "out.ply", "noise", "--seed", "-1"),
        ]:
            done = self.call(*words)
            self.assertEqual((done.returncode, done.stdout), (1, ""), words)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertEqual(sorted(self.folder.iterdir()), before, words)


if __name__ == "__main__":
    unittest.main()
