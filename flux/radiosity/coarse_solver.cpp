#include "flux/radiosity/coarse_solver.hpp"

#include <algorithm>
#include <numeric>

namespace sidewall::flux {
namespace {

// Pieces are at least so large, and at most so many: a solve then costs far less than a pass over the links.
constexpr std::size_t kUnknownsOfPiece = 16, kMostPieces = 256;

// Ends of a ray in pieces; corners in one piece add up.
struct PieceEnds {
    std::uint32_t piece[6];
    double weight[6];
    int count = 0;
    void add(std::uint32_t where, double amount) {
        for (int k = 0; k < count; ++k)
            if (piece[k] == where) {
                weight[k] += amount;
                return;
            }
        piece[count] = where;
        weight[count++] = amount;
    }
    void add(const Pieces& pieces, const Wedges& unknowns, std::uint32_t triangle, float u, float v,
             double sign) {
        const std::uint32_t* corner = &unknowns.corner[3 * std::size_t{triangle}];
        const auto second = static_cast<double>(u), third = static_cast<double>(v);
        add(pieces.of[corner[0]], sign * (1.0 - second - third));
        add(pieces.of[corner[1]], sign * second);
        add(pieces.of[corner[2]], sign * third);
    }
    void add_squares(double amount, Eigen::MatrixXd& matrix) const {
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < count; ++j) matrix(piece[i], piece[j]) += amount * weight[i] * weight[j];
    }
};

using Iterator = std::vector<std::uint32_t>::iterator;

void halve(const std::vector<Vec3>& places, Iterator begin, Iterator end, std::size_t parts, Pieces& pieces) {
    if (parts <= 1) {
        for (Iterator i = begin; i != end; ++i) pieces.of[*i] = static_cast<std::uint32_t>(pieces.count);
        ++pieces.count;
        return;
    }
    Vec3 least = places[*begin], most = least;
    for (Iterator i = begin; i != end; ++i) {
        least = least.cwiseMin(places[*i]);
        most = most.cwiseMax(places[*i]);
    }
    Eigen::Index axis = 0;
    (most - least).maxCoeff(&axis);
    const Iterator middle = begin + (end - begin) / 2;
    std::nth_element(begin, middle, end, [&](std::uint32_t a, std::uint32_t b) {
        return places[a][axis] != places[b][axis] ? places[a][axis] < places[b][axis] : a < b;
    });
    halve(places, begin, middle, parts / 2, pieces);
    halve(places, middle, end, parts / 2, pieces);
}

}  // namespace

Pieces make_pieces(const TriangleMesh& mesh, const Wedges& unknowns) {
    std::vector<Vec3> places(unknowns.count(), Vec3::Zero());
    for (std::size_t c = 0; c < unknowns.corner.size(); ++c)
        places[unknowns.corner[c]] = mesh.vertices[mesh.triangles[c / 3][c % 3]];
    std::vector<std::uint32_t> order(places.size());
    std::iota(order.begin(), order.end(), 0u);
    std::size_t parts = 1;
    while (2 * parts <= kMostPieces && 2 * parts * kUnknownsOfPiece <= places.size()) parts *= 2;
    Pieces pieces;
    pieces.of.resize(places.size());
    if (!places.empty()) halve(places, order.begin(), order.end(), parts, pieces);
    return pieces;
}

void add_links(const Pieces& pieces, const Wedges& unknowns, const LinkGroup& group, std::size_t first_link,
               std::size_t first_exit, Eigen::MatrixXd& matrix) {
    for (std::size_t n = first_link; n < group.links.size(); ++n) {
        const Link& link = group.links[n];
        PieceEnds ends;
        ends.add(pieces, unknowns, link.a, link.au, link.av, 1.0);
        ends.add(pieces, unknowns, link.b, link.bu, link.bv, -1.0);
        ends.add_squares(static_cast<double>(link.weight), matrix);
    }
    for (std::size_t n = first_exit; n < group.exits.size(); ++n) {
        const Exit& exit = group.exits[n];
        PieceEnds ends;
        ends.add(pieces, unknowns, exit.a, exit.au, exit.av, 1.0);
        ends.add_squares(static_cast<double>(exit.weight), matrix);
    }
}

CoarseSolver::CoarseSolver(const Pieces& pieces, Eigen::MatrixXd links, const MassMatrix& mass,
                           std::span<const double> absorption)
    : pieces_(pieces) {
    for (std::size_t i = 0; i < pieces.of.size(); ++i)
        for (std::size_t n = mass.first[i]; n < mass.first[i + 1]; ++n)
            links(pieces.of[i], pieces.of[mass.column[n]]) += absorption[n];
    for (Eigen::Index k = 0; k < links.rows(); ++k)
        if (!(links(k, k) > 0.0)) links(k, k) = 1.0;  // no ray met it
    factor_.compute(links);
    // Where nothing sticks and nothing leaves there is no solution, and the iteration says so.
    usable_ = pieces.count > 1 && factor_.info() == Eigen::Success && factor_.rcond() > 1e-13;
}

void CoarseSolver::add_correction(std::span<const double> r, std::span<const double> diagonal,
                                  std::span<double> z) const {
    if (!usable_) return;
    Eigen::VectorXd means = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(pieces_.count));
    for (std::size_t i = 0; i < r.size(); ++i)
        if (diagonal[i] > 0.0) means[pieces_.of[i]] += r[i];
    factor_.solveInPlace(means);
    for (std::size_t i = 0; i < r.size(); ++i)
        if (diagonal[i] > 0.0) z[i] += means[pieces_.of[i]];
}

}  // namespace sidewall::flux
