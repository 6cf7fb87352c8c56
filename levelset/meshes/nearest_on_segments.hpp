#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "levelset/openvdb_grid.hpp"
#include "surface/vec3.hpp"

namespace sidewall::levelset {

using Segments = std::vector<std::array<Vec3, 2>>;

/// Finds the point on many segments nearest to a given one, by a hash grid of their ends and of points between
/// them at most a cell apart.
class NearestOnSegments {
  public:
    NearestOnSegments() = default;
    NearestOnSegments(Segments segments, double size) : segments_(std::move(segments)), size_(size) {
        for (std::uint32_t n = 0; n < segments_.size(); ++n) {
            const auto& [a, b] = segments_[n];
            const auto list_at = [&](const Vec3& p) {
                std::vector<std::uint32_t>& list = cells_[cell(p)];
                if (list.empty() || list.back() != n) list.push_back(n);
            };
            list_at(a);
            list_at(b);
            const double parts = std::ceil((b - a).norm() / size_);
            for (double k = 1.0; k < parts; k += 1.0) list_at(a + k / parts * (b - a));
        }
    }

    /// The nearest point on the segments, none if it is farther than the size of a cell; one within half of that
    /// is sure to be found.
    std::optional<Vec3> at(const Vec3& point) const {
        std::optional<Vec3> nearest;
        double least = size_ * size_;
        const openvdb::Coord middle = cell(point);
        for (int n = 0; n < 27; ++n) {
            const auto found = cells_.find(middle.offsetBy(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
            if (found == cells_.end()) continue;
            for (const std::uint32_t s : found->second) {
                const auto& [a, b] = segments_[s];
                const Vec3 way = b - a;
                const double length = way.squaredNorm();
                const double t = length > 0.0 ? std::clamp((point - a).dot(way) / length, 0.0, 1.0) : 0.0;
                const Vec3 foot = a + t * way;
                if ((point - foot).squaredNorm() >= least) continue;
                least = (point - foot).squaredNorm();
                nearest = foot;
            }
        }
        return nearest;
    }

  private:
    struct Hash {
        std::size_t operator()(const openvdb::Coord& c) const { return c.hash<20>(); }
    };
    openvdb::Coord cell(const Vec3& p) const {
        return {static_cast<int>(std::floor(p.x() / size_)), static_cast<int>(std::floor(p.y() / size_)),
                static_cast<int>(std::floor(p.z() / size_))};
    }
    Segments segments_;
    double size_ = 1.0;
    std::unordered_map<openvdb::Coord, std::vector<std::uint32_t>, Hash> cells_;
};

}  // namespace sidewall::levelset
