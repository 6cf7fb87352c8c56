#include "flux/radiosity/coarse_grid_solver.hpp"

#include <algorithm>
#include <numeric>

namespace sidewall::flux {
namespace {

// Least size and largest number of aggregates: a coarse solve then costs far less than a pass over the pairs.
constexpr std::size_t kUnknownsOfAggregate = 16, kMostAggregates = 256;

// Hat function values at a sample's ends, negative at the second, summed by aggregate.
struct AggregateEnds {
    std::uint32_t aggregate[6];
    double weight[6];
    int count = 0;
    void add(std::uint32_t where, double amount) {
        for (int k = 0; k < count; ++k)
            if (aggregate[k] == where) {
                weight[k] += amount;
                return;
            }
        aggregate[count] = where;
        weight[count++] = amount;
    }
    void add(const Aggregates& aggregates, const Wedges& unknowns, std::uint32_t triangle, float u, float v,
             double sign) {
        const std::uint32_t* corner = &unknowns.corner[3 * std::size_t{triangle}];
        const auto second = static_cast<double>(u), third = static_cast<double>(v);
        add(aggregates.of[corner[0]], sign * (1.0 - second - third));
        add(aggregates.of[corner[1]], sign * second);
        add(aggregates.of[corner[2]], sign * third);
    }
    void add_squares(double amount, Eigen::MatrixXd& matrix) const {
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < count; ++j)
                matrix(aggregate[i], aggregate[j]) += amount * weight[i] * weight[j];
    }
};

using Iterator = std::vector<std::uint32_t>::iterator;

void halve(const std::vector<Vec3>& places, Iterator begin, Iterator end, std::size_t parts,
           Aggregates& aggregates) {
    if (parts <= 1) {
        for (Iterator i = begin; i != end; ++i)
            aggregates.of[*i] = static_cast<std::uint32_t>(aggregates.count);
        ++aggregates.count;
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
    halve(places, begin, middle, parts / 2, aggregates);
    halve(places, middle, end, parts / 2, aggregates);
}

}  // namespace

Aggregates make_aggregates(const TriangleMesh& mesh, const Wedges& unknowns) {
    std::vector<Vec3> places(unknowns.count(), Vec3::Zero());
    for (std::size_t c = 0; c < unknowns.corner.size(); ++c)
        places[unknowns.corner[c]] = mesh.vertices[mesh.triangles[c / 3][c % 3]];
    std::vector<std::uint32_t> order(places.size());
    std::iota(order.begin(), order.end(), 0u);
    std::size_t parts = 1;
    while (2 * parts <= kMostAggregates && 2 * parts * kUnknownsOfAggregate <= places.size()) parts *= 2;
    Aggregates aggregates;
    aggregates.of.resize(places.size());
    if (!places.empty()) halve(places, order.begin(), order.end(), parts, aggregates);
    return aggregates;
}

void add_exchange(const Aggregates& aggregates, const Wedges& unknowns, const SampleGroup& group,
                  std::size_t first_pair, std::size_t first_exit, Eigen::MatrixXd& matrix) {
    for (std::size_t n = first_pair; n < group.pairs.size(); ++n) {
        const PairSample& pair = group.pairs[n];
        AggregateEnds ends;
        ends.add(aggregates, unknowns, pair.a, pair.au, pair.av, 1.0);
        ends.add(aggregates, unknowns, pair.b, pair.bu, pair.bv, -1.0);
        ends.add_squares(static_cast<double>(pair.weight), matrix);
    }
    for (std::size_t n = first_exit; n < group.exits.size(); ++n) {
        const ExitSample& exit = group.exits[n];
        AggregateEnds ends;
        ends.add(aggregates, unknowns, exit.a, exit.au, exit.av, 1.0);
        ends.add_squares(static_cast<double>(exit.weight), matrix);
    }
}

Eigen::MatrixXd aggregate_sums(const Aggregates& aggregates, const WedgeMatrix& mass,
                               const Eigen::MatrixXd& exchange) {
    const auto count = static_cast<Eigen::Index>(aggregates.count);
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(count, count);
    for (std::size_t i = 0; i < aggregates.of.size(); ++i) {
        for (std::size_t j = 0; j < aggregates.of.size(); ++j)
            sums(aggregates.of[j], aggregates.of[i]) -=
                exchange(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i));
        for (WedgeMatrix::InnerIterator entry(mass, static_cast<Eigen::Index>(i)); entry; ++entry)
            sums(aggregates.of[static_cast<std::size_t>(entry.col())], aggregates.of[i]) += entry.value();
    }
    return sums;
}

CoarseGridSolver::CoarseGridSolver(const Aggregates& aggregates, Eigen::MatrixXd exchange,
                                   const WedgeMatrix& absorption)
    : aggregates_(aggregates) {
    for (std::size_t i = 0; i < aggregates.of.size(); ++i)
        for (WedgeMatrix::InnerIterator entry(absorption, i); entry; ++entry)
            exchange(aggregates.of[i], aggregates.of[entry.col()]) += entry.value();
    for (Eigen::Index k = 0; k < exchange.rows(); ++k)
        if (!(exchange(k, k) > 0.0)) exchange(k, k) = 1.0;  // an aggregate without rays
    factor_.compute(exchange);
    // Without sticking and exits the matrix is singular; conjugate gradients then report it.
    usable_ = aggregates.count > 1 && factor_.info() == Eigen::Success && factor_.rcond() > 1e-13;
}

void CoarseGridSolver::add_correction(std::span<const double> r, std::span<const double> diagonal,
                                      std::span<double> z) const {
    if (!usable_) return;
    Eigen::VectorXd means = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(aggregates_.count));
    for (std::size_t i = 0; i < r.size(); ++i)
        if (diagonal[i] > 0.0) means[aggregates_.of[i]] += r[i];
    factor_.solveInPlace(means);
    for (std::size_t i = 0; i < r.size(); ++i)
        if (diagonal[i] > 0.0) z[i] += means[aggregates_.of[i]];
}

}  // namespace sidewall::flux
