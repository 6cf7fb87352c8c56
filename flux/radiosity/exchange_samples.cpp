#include "flux/radiosity/exchange_samples.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "flux/radiosity/ring_sky.hpp"
#include "surface/parallel.hpp"

namespace sidewall::flux {
namespace {

constexpr std::size_t kPartsOfGroup = 2;  // parallel tasks a group
constexpr int kBalancings = 3;            // iterations of Sinkhorn's balancing

// The unknowns and hat function values at one end of a ray.
struct Ends {
    const std::uint32_t* corner;
    double weight[3];
    Ends(const Wedges& wedges, std::uint32_t triangle, float u, float v)
        : corner(&wedges.corner[3 * std::size_t{triangle}]),
          weight{1.0 - static_cast<double>(u) - static_cast<double>(v), static_cast<double>(u),
                 static_cast<double>(v)} {}
    double value(const double* x) const {
        return weight[0] * x[corner[0]] + weight[1] * x[corner[1]] + weight[2] * x[corner[2]];
    }
    void add(double amount, double* y) const {
        for (int k = 0; k < 3; ++k) y[corner[k]] += amount * weight[k];
    }
    // Adds the diagonal of amount b b'. In a profile, two corners of a triangle may be the same unknown.
    void add_squares(double amount, double* y) const {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (corner[i] == corner[j]) y[corner[i]] += amount * weight[i] * weight[j];
    }
};

}  // namespace

// The entry of two neighbours is that of the mass matrix times m - 1. m is the smaller of their 1/(1-s),
// times 1 less |ln of their ratio|, at least 0. An open plane is then solved to within the square of the
// difference; beyond a ratio of e each wedge absorbs separately. m never exceeds their harmonic mean, which
// keeps the matrix positive semidefinite. The diagonal keeps the absorption of a constant emission.
WedgeMatrix absorption_matrix(const WedgeMatrix& mass, std::span<const double> area,
                              std::span<const double> ratio) {
    WedgeMatrix absorption = mass;  // NOLINT(performance-unnecessary-copy-initialization): iterators write
    for (std::size_t i = 0; i < area.size(); ++i) {
        double rest = ratio[i] * area[i];
        double* diagonal = nullptr;
        for (WedgeMatrix::InnerIterator entry(absorption, i); entry; ++entry) {
            const std::size_t j = entry.col();
            if (j == i) {
                diagonal = &entry.valueRef();
                continue;
            }
            const double own = 1.0 + ratio[i], other = 1.0 + ratio[j];
            const double shared = std::min(own, other) * std::max(0.0, 1.0 - std::abs(std::log(own / other)));
            entry.valueRef() *= shared - 1.0;
            rest -= entry.value();
        }
        if (diagonal != nullptr) *diagonal = rest;
    }
    return absorption;
}

WedgeMatrix mass_matrix(const TriangleMesh& mesh, const Wedges& wedges) {
    const auto count = static_cast<int>(wedges.count());
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(3 * wedges.corner.size());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
        const std::size_t t = c / 3;
        const double twelfth = triangle_area(mesh, t) / 12.0;
        for (std::size_t other = 3 * t; other < 3 * t + 3; ++other)
            entries.emplace_back(wedges.corner[c], wedges.corner[other],
                                 other == c ? 2.0 * twelfth : twelfth);
    }
    WedgeMatrix mass(count, count);
    mass.setFromTriplets(entries.begin(), entries.end());
    return mass;
}

// Ranges of pairs and exits of a part of a group, which one task sums up.
struct BalancedSamples::Part {
    std::size_t group = 0, pair = 0, pairs = 0, exit = 0, exits = 0;
};

template <class Use>
void BalancedSamples::for_pairs(const Part& part, const Use& use) const {
    const std::vector<PairSample>& pairs = groups_[part.group]->pairs;
    for (std::size_t n = part.pair; n < part.pairs; ++n)
        use(n, Ends(wedges_, pairs[n].a, pairs[n].au, pairs[n].av),
            Ends(wedges_, pairs[n].b, pairs[n].bu, pairs[n].bv));
}

template <class Use>
void BalancedSamples::for_exits(const Part& part, const Use& use) const {
    const std::vector<ExitSample>& exits = groups_[part.group]->exits;
    for (std::size_t n = part.exit; n < part.exits; ++n)
        use(n, Ends(wedges_, exits[n].a, exits[n].au, exits[n].av));
}

// Calls use(part, sums) for every part of every group, each with separate sums, and adds these, scaled, to
// \p y in the order of the parts, which do not depend on the threads.
template <class Use>
void BalancedSamples::sum_parts(std::span<double> y, const Use& use) const {
    const std::size_t parts = kPartsOfGroup * groups_.size();
    std::vector<std::vector<double>> sums(parts);
    tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t number) {
        sums[number].assign(y.size(), 0.0);
        const std::size_t g = number / kPartsOfGroup, half = number % kPartsOfGroup;
        const auto cut = [half](std::size_t size, std::size_t end) {
            return size * (half + end) / kPartsOfGroup;
        };
        const std::size_t pairs = groups_[g]->pairs.size(), exits = groups_[g]->exits.size();
        use(Part{g, cut(pairs, 0), cut(pairs, 1), cut(exits, 0), cut(exits, 1)}, sums[number].data());
    });
    surface::parallel_each(y.size(), 4096, [&](std::size_t i) {
        double sum = 0.0;
        for (const std::vector<double>& part : sums) sum += part[i];
        y[i] += scale_ * sum;
    });
}

// Multiplies samples by factors of both ends, which keep the balance symmetric (Sinkhorn's iteration).
BalancedSamples::BalancedSamples(const Wedges& wedges, std::vector<const SampleGroup*> groups, double scale,
                                 const RingSky* sky)
    : wedges_(wedges), groups_(std::move(groups)), scale_(scale), diagonal_(wedges.count(), 0.0) {
    std::vector<double> within = wedges.area;  // what the balanced samples of each wedge must sum to
    if (sky != nullptr) {
        direct_ = sky->direct;
        for (std::size_t i = 0; i < within.size(); ++i) within[i] -= sky->leaving[i];
    }
    for (const SampleGroup* group : groups_) {
        std::ranges::transform(group->pairs, weights_.emplace_back(group->pairs.size()).begin(),
                               &PairSample::weight);
        std::ranges::transform(group->exits, exit_weights_.emplace_back(group->exits.size()).begin(),
                               &ExitSample::weight);
    }
    std::vector<double> sum(wedges_.count()), factor;
    // Multiplies a weight by the factors of the last pass and returns it.
    const auto weigh = [&](std::size_t group, std::size_t n, const Ends& a, const Ends& b) {
        float& weight = weights_[group][n];
        if (!factor.empty()) weight *= static_cast<float>(a.value(factor.data()) * b.value(factor.data()));
        return static_cast<double>(weight);
    };
    const auto weigh_exit = [&](std::size_t group, std::size_t n, const Ends& a) {
        float& weight = exit_weights_[group][n];
        if (!factor.empty() && sky == nullptr) weight *= static_cast<float>(a.value(factor.data()));
        return static_cast<double>(weight);
    };
    for (int pass = 0; pass < kBalancings; ++pass) {
        std::ranges::fill(sum, 0.0);
        sum_parts(sum, [&](const Part& part, double* y) {
            for_pairs(part, [&](std::size_t n, const Ends& a, const Ends& b) {
                const double w = weigh(part.group, n, a, b);
                a.add(w, y);
                b.add(w, y);
            });
            if (sky == nullptr)
                for_exits(part,
                          [&](std::size_t n, const Ends& a) { a.add(weigh_exit(part.group, n, a), y); });
        });
        factor.resize(sum.size());
        for (std::size_t i = 0; i < sum.size(); ++i)
            factor[i] =
                sum[i] > 0.0 ? std::clamp(std::sqrt(std::max(0.0, within[i]) / sum[i]), 0.5, 2.0) : 1.0;
    }
    sum_parts(diagonal_, [&](const Part& part, double* y) {
        for_pairs(part, [&](std::size_t n, const Ends& a, const Ends& b) {
            const double w = weigh(part.group, n, a, b);
            a.add_squares(w, y);
            b.add_squares(w, y);
            // Unknowns that both ends share.
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if (a.corner[i] == b.corner[j]) y[a.corner[i]] -= 2.0 * w * a.weight[i] * b.weight[j];
        });
        for_exits(part,
                  [&](std::size_t n, const Ends& a) { a.add_squares(weigh_exit(part.group, n, a), y); });
    });
}

BalancedSamples::BalancedSamples(const Wedges& wedges, const ProfileView& view, const WedgeMatrix& mass,
                                 std::span<const double> exponents)
    : wedges_(wedges), scale_(1.0), diagonal_(wedges.count(), 0.0), viewed_{{view.exchange, mass}} {
    Eigen::VectorXd sky = Eigen::Map<const Eigen::VectorXd>(view.sky.data(), std::ssize(view.sky));
    Eigen::VectorXd factors = Eigen::VectorXd::Ones(sky.size()), factor = factors;
    // Cheap, and enough for elements far longer than their distance to what they face.
    constexpr int kBalancingsOfView = 20;
    for (int pass = 0; pass < kBalancingsOfView; ++pass) {
        const Eigen::VectorXd sum = factors.cwiseProduct(view.exchange * factors + sky);
        for (Eigen::Index i = 0; i < sum.size(); ++i)
            if (sum[i] > 0.0)
                factors[i] *=
                    std::clamp(std::sqrt(wedges_.area[static_cast<std::size_t>(i)] / sum[i]), 0.5, 2.0);
    }
    viewed_->exchange = factors.asDiagonal() * view.exchange * factors.asDiagonal();
    for (std::size_t k = 0; k < exponents.size(); ++k) {
        std::vector<double>& direct = direct_[exponents[k]] = view.direct[k];
        for (std::size_t i = 0; i < direct.size(); ++i) direct[i] *= factors[static_cast<Eigen::Index>(i)];
    }
    for (std::size_t i = 0; i < diagonal_.size(); ++i) {
        const auto n = static_cast<Eigen::Index>(i);
        diagonal_[i] = mass.coeff(n, n) - viewed_->exchange(n, n);
    }
}

void BalancedSamples::add(std::span<const double> x, std::span<double> y) const {
    if (viewed_) {
        const Eigen::Map<const Eigen::VectorXd> values(x.data(), std::ssize(x));
        surface::parallel_each(y.size(), 64, [&](std::size_t i) {
            const auto n = static_cast<Eigen::Index>(i);
            y[i] -= viewed_->exchange.col(n).dot(values);
            for (WedgeMatrix::InnerIterator entry(viewed_->mass, n); entry; ++entry)
                y[i] += entry.value() * x[static_cast<std::size_t>(entry.col())];
        });
        return;
    }
    sum_parts(y, [&](const Part& part, double* sums) {
        for_pairs(part, [&](std::size_t n, const Ends& a, const Ends& b) {
            const double amount =
                static_cast<double>(weights_[part.group][n]) * (a.value(x.data()) - b.value(x.data()));
            a.add(amount, sums);
            b.add(-amount, sums);
        });
        for_exits(part, [&](std::size_t n, const Ends& a) {
            a.add(static_cast<double>(exit_weights_[part.group][n]) * a.value(x.data()), sums);
        });
    });
}

std::vector<double> BalancedSamples::direct(double exponent) const {
    if (!direct_.empty()) return direct_.at(exponent);
    const double scale = lobe_scale(exponent);
    std::vector<double> y(wedges_.count(), 0.0);
    sum_parts(y, [&](const Part& part, double* sums) {
        for_exits(part, [&](std::size_t n, const Ends& a) {
            const float cosine = groups_[part.group]->exits[n].cosine;
            if (cosine > 0.0f)
                a.add(static_cast<double>(exit_weights_[part.group][n]) * scale *
                          lobe(exponent, static_cast<double>(cosine)),
                      sums);
        });
    });
    return y;
}

std::vector<double> BalancedSamples::arrivals(std::span<const double> x) const {
    std::vector<double> y(x.size(), 0.0);
    if (viewed_) {
        const Eigen::Map<const Eigen::VectorXd> values(x.data(), std::ssize(x));
        surface::parallel_each(y.size(), 64, [&](std::size_t i) {
            y[i] = viewed_->exchange.col(static_cast<Eigen::Index>(i)).dot(values);
        });
        return y;
    }
    sum_parts(y, [&](const Part& part, double* sums) {
        for_pairs(part, [&](std::size_t n, const Ends& a, const Ends& b) {
            const auto w = static_cast<double>(weights_[part.group][n]);
            a.add(w * b.value(x.data()), sums);
            b.add(w * a.value(x.data()), sums);
        });
    });
    return y;
}

Balance::Balance(const BalancedSamples& samples, const WedgeMatrix& absorption)
    : samples_(samples),
      absorption_(absorption),
      diagonal_(samples.diagonal().begin(), samples.diagonal().end()) {
    for (std::size_t i = 0; i < diagonal_.size(); ++i) diagonal_[i] += absorption_.coeff(i, i);
}

void Balance::apply(std::span<const double> x, std::span<double> y) const {
    surface::parallel_each(y.size(), 4096, [&](std::size_t i) {
        double sum = 0.0;
        for (WedgeMatrix::InnerIterator entry(absorption_, i); entry; ++entry)
            sum += entry.value() * x[entry.col()];
        y[i] = sum;
    });
    samples_.add(x, y);
}

}  // namespace sidewall::flux
