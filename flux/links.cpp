#include "flux/links.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sidewall::flux {
namespace {

constexpr std::size_t kPartsOfGroup = 2;
constexpr int kBalancings = 3;

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
    // Corners of a strip's triangle may be one unknown.
    void add_squares(double amount, double* y) const {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (corner[i] == corner[j]) y[corner[i]] += amount * weight[i] * weight[j];
    }
};

}  // namespace

// What two neighbours share is the smaller 1 / (1 - s) less 1,
// which solves an open plane to within the square of the difference, and less the more they differ: where all
// sticks nothing but the neighbour's own absorption counts. Never above their harmonic mean, so that the
// matrix is not negative; the diagonal keeps what each absorbs of a constant emission.
std::vector<double> absorption_matrix(const MassMatrix& mass, std::span<const double> area,
                                      std::span<const double> ratio) {
    std::vector<double> value(mass.value.size(), 0.0);
    for (std::size_t i = 0; i < area.size(); ++i) {
        double rest = ratio[i] * area[i];
        std::size_t diagonal = 0;
        for (std::size_t n = mass.first[i]; n < mass.first[i + 1]; ++n) {
            const std::uint32_t j = mass.column[n];
            if (j == i) {
                diagonal = n;
                continue;
            }
            const double own = 1.0 + ratio[i], other = 1.0 + ratio[j];
            const double shared = std::min(own, other) * std::max(0.0, 1.0 - std::abs(std::log(own / other)));
            value[n] = mass.value[n] * (shared - 1.0);
            rest -= value[n];
        }
        if (mass.first[i] < mass.first[i + 1]) value[diagonal] = rest;
    }
    return value;
}

double lobe_scale(double exponent, bool straight) {
    if (!straight) return 0.5 * (exponent + 1.0);
    return 2.0 * std::numbers::inv_sqrtpi *
           std::exp(std::lgamma(0.5 * exponent + 1.0) - std::lgamma(0.5 * (exponent + 1.0)));
}

MassMatrix mass_matrix(const TriangleMesh& mesh, const Wedges& wedges) {
    struct Entry {
        std::uint32_t row, column;
        double value;
    };
    std::vector<Entry> entries;
    entries.reserve(9 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::uint32_t* corner = &wedges.corner[3 * t];
        const double twelfth = triangle_area(mesh, t) / 12.0;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                entries.push_back({corner[i], corner[j], i == j ? 2.0 * twelfth : twelfth});
    }
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.row != b.row ? a.row < b.row : a.column < b.column;
    });
    MassMatrix mass;
    mass.first.assign(wedges.count() + 1, 0);
    for (std::size_t n = 0; n < entries.size(); ++n) {
        const Entry& entry = entries[n];
        if (n > 0 && entries[n - 1].row == entry.row && entries[n - 1].column == entry.column) {
            mass.value.back() += entry.value;
            continue;
        }
        mass.column.push_back(entry.column);
        mass.value.push_back(entry.value);
        ++mass.first[entry.row + 1];
    }
    for (std::size_t i = 0; i < wedges.count(); ++i) mass.first[i + 1] += mass.first[i];
    return mass;
}

// Some links and exits of a group, with their balanced weights.
struct BalancedLinks::Part {
    const Link* links;
    const float* weight;
    std::size_t count;
    const Exit* exits;
    const float* exit_weight;
    std::size_t leaving;
};

BalancedLinks::BalancedLinks(const Wedges& wedges, std::vector<const LinkGroup*> groups, double scale)
    : wedges_(wedges), groups_(std::move(groups)), scale_(scale), diagonal_(wedges.count(), 0.0) {
    balance_weights();
    sum_parts(diagonal_, [this](const Part& part, double* y) {
        for (std::size_t n = 0; n < part.count; ++n) {
            const Link& link = part.links[n];
            const Ends a(wedges_, link.a, link.au, link.av), b(wedges_, link.b, link.bu, link.bv);
            const auto w = static_cast<double>(part.weight[n]);
            a.add_squares(w, y);
            b.add_squares(w, y);
            // A corner that both ends share.
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if (a.corner[i] == b.corner[j]) y[a.corner[i]] -= 2.0 * w * a.weight[i] * b.weight[j];
        }
        for (std::size_t n = 0; n < part.leaving; ++n)
            Ends(wedges_, part.exits[n].a, part.exits[n].au, part.exits[n].av)
                .add_squares(static_cast<double>(part.exit_weight[n]), y);
    });
}

// Factors of both ends of a link, found by Sinkhorn's iteration, keep the balance symmetric.
void BalancedLinks::balance_weights() {
    for (const LinkGroup* group : groups_) {
        std::vector<float>& weight = weights_.emplace_back();
        for (const Link& link : group->links) weight.push_back(link.weight);
        std::vector<float>& exit = exit_weights_.emplace_back();
        for (const Exit& one : group->exits) exit.push_back(one.weight);
    }
    std::vector<double> sum(wedges_.count()), factor(wedges_.count());
    for (int pass = 0; pass < kBalancings; ++pass) {
        std::fill(sum.begin(), sum.end(), 0.0);
        sum_parts(sum, [this](const Part& part, double* y) {
            for (std::size_t n = 0; n < part.count; ++n) {
                const Link& link = part.links[n];
                const auto w = static_cast<double>(part.weight[n]);
                Ends(wedges_, link.a, link.au, link.av).add(w, y);
                Ends(wedges_, link.b, link.bu, link.bv).add(w, y);
            }
            for (std::size_t n = 0; n < part.leaving; ++n)
                Ends(wedges_, part.exits[n].a, part.exits[n].au, part.exits[n].av)
                    .add(static_cast<double>(part.exit_weight[n]), y);
        });
        for (std::size_t i = 0; i < sum.size(); ++i)
            factor[i] = sum[i] > 0.0 ? std::clamp(std::sqrt(wedges_.area[i] / sum[i]), 0.5, 2.0) : 1.0;
        tbb::parallel_for(std::size_t{0}, groups_.size(), [&](std::size_t g) {
            const LinkGroup& group = *groups_[g];
            for (std::size_t n = 0; n < group.links.size(); ++n) {
                const Link& link = group.links[n];
                weights_[g][n] *=
                    static_cast<float>(Ends(wedges_, link.a, link.au, link.av).value(factor.data()) *
                                       Ends(wedges_, link.b, link.bu, link.bv).value(factor.data()));
            }
            for (std::size_t n = 0; n < group.exits.size(); ++n) {
                const Exit& exit = group.exits[n];
                exit_weights_[g][n] *=
                    static_cast<float>(Ends(wedges_, exit.a, exit.au, exit.av).value(factor.data()));
            }
        });
    }
}

// Calls use(part, sums) for every part of every group, each with sums of its own, and adds them, scaled, to
// \p y in their order: the parts do not depend on the threads.
template <class Use>
void BalancedLinks::sum_parts(std::span<double> y, const Use& use) const {
    const std::size_t parts = kPartsOfGroup * groups_.size();
    std::vector<std::vector<double>> sums(parts);
    tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t number) {
        sums[number].assign(y.size(), 0.0);
        const std::size_t g = number / kPartsOfGroup, half = number % kPartsOfGroup;
        const LinkGroup& group = *groups_[g];
        const auto cut = [half](std::size_t size, std::size_t end) {
            return size * (half + end) / kPartsOfGroup;
        };
        const std::size_t link = cut(group.links.size(), 0), exit = cut(group.exits.size(), 0);
        use(Part{group.links.data() + link, weights_[g].data() + link, cut(group.links.size(), 1) - link,
                 group.exits.data() + exit, exit_weights_[g].data() + exit,
                 cut(group.exits.size(), 1) - exit},
            sums[number].data());
    });
    tbb::parallel_for(tbb::blocked_range(std::size_t{0}, y.size(), 4096), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            double sum = 0.0;
            for (const std::vector<double>& part : sums) sum += part[i];
            y[i] += scale_ * sum;
        }
    });
}

void BalancedLinks::add(std::span<const double> x, std::span<double> y) const {
    sum_parts(y, [&](const Part& part, double* sums) {
        for (std::size_t n = 0; n < part.count; ++n) {
            const Link& link = part.links[n];
            const Ends a(wedges_, link.a, link.au, link.av), b(wedges_, link.b, link.bu, link.bv);
            const double amount =
                static_cast<double>(part.weight[n]) * (a.value(x.data()) - b.value(x.data()));
            a.add(amount, sums);
            b.add(-amount, sums);
        }
        for (std::size_t n = 0; n < part.leaving; ++n) {
            const Ends a(wedges_, part.exits[n].a, part.exits[n].au, part.exits[n].av);
            a.add(static_cast<double>(part.exit_weight[n]) * a.value(x.data()), sums);
        }
    });
}

std::vector<double> BalancedLinks::direct(double exponent, bool straight) const {
    const double scale = lobe_scale(exponent, straight);
    std::vector<double> y(wedges_.count(), 0.0);
    sum_parts(y, [&](const Part& part, double* sums) {
        for (std::size_t n = 0; n < part.leaving; ++n) {
            const Exit& exit = part.exits[n];
            if (exit.cosine > 0.0f)
                Ends(wedges_, exit.a, exit.au, exit.av)
                    .add(static_cast<double>(part.exit_weight[n]) * scale *
                             lobe(exponent, static_cast<double>(exit.cosine)),
                         sums);
        }
    });
    return y;
}

std::vector<double> BalancedLinks::arrivals(std::span<const double> x) const {
    std::vector<double> y(x.size(), 0.0);
    sum_parts(y, [&](const Part& part, double* sums) {
        for (std::size_t n = 0; n < part.count; ++n) {
            const Link& link = part.links[n];
            const Ends a(wedges_, link.a, link.au, link.av), b(wedges_, link.b, link.bu, link.bv);
            const auto w = static_cast<double>(part.weight[n]);
            a.add(w * b.value(x.data()), sums);
            b.add(w * a.value(x.data()), sums);
        }
    });
    return y;
}

Balance::Balance(const BalancedLinks& links, const MassMatrix& mass, std::span<const double> absorption)
    : links_(links),
      mass_(mass),
      absorption_(absorption),
      diagonal_(links.diagonal().begin(), links.diagonal().end()) {
    for (std::size_t i = 0; i < diagonal_.size(); ++i)
        for (std::size_t n = mass_.first[i]; n < mass_.first[i + 1]; ++n)
            if (mass_.column[n] == i) diagonal_[i] += absorption_[n];
}

void Balance::apply(std::span<const double> x, std::span<double> y) const {
    tbb::parallel_for(tbb::blocked_range(std::size_t{0}, y.size(), 4096), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            double sum = 0.0;
            for (std::size_t n = mass_.first[i]; n < mass_.first[i + 1]; ++n)
                sum += absorption_[n] * x[mass_.column[n]];
            y[i] = sum;
        }
    });
    links_.add(x, y);
}

}  // namespace sidewall::flux
