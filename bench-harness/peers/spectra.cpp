// Solves S h = λ D h with Spectra's Lanczos method in shift-invert mode, and prints what it cost.
//
//     spectra FACTORISATION MATRICES COUNT TOLERANCE RESULT
//
// FACTORISATION: eigen (SimplicialLDLT) or, where this was compiled with -DCHOLMOD, cholmod (supernodal). MATRICES, RESULT and the
// JSON object that is printed are as eigen.py has them. The pairs are those of D^-1/2 S D^-1/2.

#include <chrono>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <Spectra/SymEigsShiftSolver.h>
#ifdef CHOLMOD
#include <Eigen/CholmodSupport>
#endif

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

// Of the mesh scaled to unit area, where eigenvalues are about 4π k: just below the spectrum, so that A − σ I is definite.
constexpr double SHIFT = -0.01;

template <class T> std::vector<T> read(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) throw std::runtime_error(path + ": can't be read");
    std::vector<T> numbers(static_cast<std::size_t>(file.tellg()) / sizeof(T));
    file.seekg(0).read(reinterpret_cast<char*>(numbers.data()), static_cast<std::streamsize>(numbers.size() * sizeof(T)));
    return numbers;
}

void write(const std::string& path, const double* numbers, Eigen::Index count) {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(numbers), static_cast<std::streamsize>(count * sizeof(double)));
    if (!file) throw std::runtime_error(path + ": can't be written");
}

// A = D^-1/2 S D^-1/2, for masses of total 1.
Matrix standard(const std::string& folder, const Vector& mass) {
    const auto offsets = read<std::uint64_t>(folder + "/offsets.u64");
    const auto columns = read<std::uint64_t>(folder + "/columns.u64");
    const auto values = read<double>(folder + "/values.f64");
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(values.size());
    for (Eigen::Index i = 0; i < mass.size(); ++i)
        for (auto e = offsets[i]; e < offsets[i + 1]; ++e) {
            const auto j = static_cast<Eigen::Index>(columns[e]);
            entries.emplace_back(i, j, values[e] / std::sqrt(mass[i] * mass[j]));
        }
    Matrix matrix(mass.size(), mass.size());
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
}

// y = (A − σ I)^-1 x, as Spectra asks for it.
template <class Factor> class Inverse {
public:
    using Scalar = double;
    explicit Inverse(const Matrix& matrix) : matrix(matrix) {}
    Eigen::Index rows() const { return matrix.rows(); }
    Eigen::Index cols() const { return matrix.cols(); }
    void set_shift(double shift) {
        Matrix identity(rows(), cols());
        identity.setIdentity();
        factor.compute(matrix - shift * identity);
        if (factor.info() != Eigen::Success) throw std::runtime_error("the factorisation failed");
    }
    void perform_op(const double* x, double* y) const {
        Eigen::Map<Vector>(y, rows()) = factor.solve(Eigen::Map<const Vector>(x, rows()));
    }

private:
    const Matrix& matrix;
    Factor factor;
};

struct Pairs {
    Vector values;
    Eigen::MatrixXd vectors;
};

template <class Factor> Pairs solve(const Matrix& matrix, Eigen::Index count, double tolerance) {
    Inverse<Factor> inverse(matrix);
    // As many Lanczos vectors as Spectra advises.
    Spectra::SymEigsShiftSolver<Inverse<Factor>> solver(inverse, count, 2 * count, SHIFT);
    solver.init();
    solver.compute(Spectra::SortRule::LargestMagn, 1000, tolerance, Spectra::SortRule::SmallestAlge);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

Pairs solve(const std::string& factorisation, const Matrix& matrix, Eigen::Index count, double tolerance) {
    if (factorisation == "eigen") return solve<Eigen::SimplicialLDLT<Matrix>>(matrix, count, tolerance);
#ifdef CHOLMOD
    if (factorisation == "cholmod") return solve<Eigen::CholmodSupernodalLLT<Matrix>>(matrix, count, tolerance);
#endif
    throw std::runtime_error(factorisation + ": no such factorisation here");
}

int main(int argc, char** argv) try {
    if (argc != 6) throw std::runtime_error("usage: spectra FACTORISATION MATRICES COUNT TOLERANCE RESULT");
    const std::string factorisation = argv[1], folder = argv[2], result = argv[5];
    const auto masses = read<double>(folder + "/mass.f64");
    Vector mass = Eigen::Map<const Vector>(masses.data(), static_cast<Eigen::Index>(masses.size()));
    const double area = mass.sum();
    mass /= area;
    const Matrix matrix = standard(folder, mass);

    const auto begun = std::chrono::steady_clock::now();
    const std::clock_t cpu_begun = std::clock();
    Pairs pairs = solve(factorisation, matrix, std::stol(argv[3]), std::stod(argv[4]));
    pairs.vectors = (mass.cwiseSqrt().cwiseInverse().asDiagonal() * pairs.vectors).eval();
    const double cpu = static_cast<double>(std::clock() - cpu_begun) / CLOCKS_PER_SEC;
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();

    pairs.values /= area;
    pairs.vectors /= std::sqrt(area);
    write(result + "/eigenvalues.f64", pairs.values.data(), pairs.values.size());
    write(result + "/eigenfunctions.f64", pairs.vectors.data(), pairs.vectors.size());
    std::cout << "{\"cpu\": " << cpu << ", \"wall\": " << wall << "}\n";
} catch (const std::exception& error) {
    std::cerr << "spectra: " << error.what() << '\n';
    return 1;
}
