#include "flux/links.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace sidewall::flux {
namespace {

constexpr std::size_t kPartsOfGroup = 2;

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
    void add_squares(double amount, double* y) const {
        for (int k = 0; k < 3; ++k) y[corner[k]] += amount * weight[k] * weight[k];
    }
};

// The wedges' absorption as a symmetric matrix: the mean of s / (1 - s) that two neighbours share is their
// harmonic one, so that where all sticks nothing but the neighbour's own absorption counts; the diagonal
// keeps what each absorbs of a constant flux.
std::vector<double> absorption(const MassMatrix& mass, std::span<const double> area,
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
            const double sum = ratio[i] + ratio[j];
            value[n] = sum > 0.0 ? mass.value[n] * 2.0 * ratio[i] * ratio[j] / sum : 0.0;
            rest -= value[n];
        }
        if (mass.first[i] < mass.first[i + 1]) value[diagonal] = rest;
    }
    return value;
}

}  // namespace

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

Balance::Balance(const Wedges& wedges, const MassMatrix& mass, std::span<const double> ratio,
                 std::vector<const LinkGroup*> groups, double scale)
    : wedges_(wedges),
      mass_(mass),
      absorption_(absorption(mass, wedges.area, ratio)),
      groups_(std::move(groups)),
      scale_(scale),
      diagonal_(wedges.count(), 0.0) {
    sum_parts(diagonal_, [this](const Link* links, std::size_t count, const Exit* exits, std::size_t leaving,
                                double* y) {
        for (std::size_t n = 0; n < count; ++n) {
            const Link& link = links[n];
            const Ends a(wedges_, link.a, link.au, link.av), b(wedges_, link.b, link.bu, link.bv);
            const auto w = static_cast<double>(link.weight);
            a.add_squares(w, y);
            b.add_squares(w, y);
            // A corner that both ends share.
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if (a.corner[i] == b.corner[j]) y[a.corner[i]] -= 2.0 * w * a.weight[i] * b.weight[j];
        }
        for (std::size_t n = 0; n < leaving; ++n)
            Ends(wedges_, exits[n].a, exits[n].au, exits[n].av)
                .add_squares(static_cast<double>(exits[n].weight), y);
    });
    for (std::size_t i = 0; i < diagonal_.size(); ++i)
        for (std::size_t n = mass_.first[i]; n < mass_.first[i + 1]; ++n)
            if (mass_.column[n] == i) diagonal_[i] += absorption_[n];
}

// Calls use(links, count, exits, count, sums) for every part of every group, each with sums of its own, and
// adds them, scaled, to \p y in their order: the parts do not depend on the threads.
template <class Use>
void Balance::sum_parts(std::span<double> y, const Use& use) const {
    const std::size_t parts = kPartsOfGroup * groups_.size();
    std::vector<std::vector<double>> sums(parts);
    tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
        sums[part].assign(y.size(), 0.0);
        const LinkGroup& group = *groups_[part / kPartsOfGroup];
        const std::size_t half = part % kPartsOfGroup;
        const auto cut = [half](std::size_t size, std::size_t end) {
            return size * (half + end) / kPartsOfGroup;
        };
        const std::size_t link = cut(group.links.size(), 0), exit = cut(group.exits.size(), 0);
        use(group.links.data() + link, cut(group.links.size(), 1) - link, group.exits.data() + exit,
            cut(group.exits.size(), 1) - exit, sums[part].data());
    });
    tbb::parallel_for(tbb::blocked_range(std::size_t{0}, y.size(), 4096), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            double sum = 0.0;
            for (const std::vector<double>& part : sums) sum += part[i];
            y[i] += scale_ * sum;
        }
    });
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
    sum_parts(y, [&](const Link* links, std::size_t count, const Exit* exits, std::size_t leaving,
                     double* sums) {
        for (std::size_t n = 0; n < count; ++n) {
            const Link& link = links[n];
            const Ends a(wedges_, link.a, link.au, link.av), b(wedges_, link.b, link.bu, link.bv);
            const double amount = static_cast<double>(link.weight) * (a.value(x.data()) - b.value(x.data()));
            a.add(amount, sums);
            b.add(-amount, sums);
        }
        for (std::size_t n = 0; n < leaving; ++n) {
            const Ends a(wedges_, exits[n].a, exits[n].au, exits[n].av);
            a.add(static_cast<double>(exits[n].weight) * a.value(x.data()), sums);
        }
    });
}

std::vector<double> Balance::arrivals(std::span<const double> x) const {
    std::vector<double> y(x.size(), 0.0);
    sum_parts(y, [&](const Link* links, std::size_t count, const Exit*, std::size_t, double* sums) {
        for (std::size_t n = 0; n < count; ++n) {
            const Link& link = links[n];
            const Ends a(wedges_, link.a, link.au, link.av), b(wedges_, link.b, link.bu, link.bv);
            a.add(static_cast<double>(link.weight) * b.value(x.data()), sums);
            b.add(static_cast<double>(link.weight) * a.value(x.data()), sums);
        }
    });
    return y;
}

}  // namespace sidewall::flux
