#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "levelset/layers/stack.hpp"
#include "surface/cut.hpp"
#include "surface/extraction/marching_cubes.hpp"

namespace sidewall::levelset {

/// Selects the columns of cells within a distance (world units) of a plane across x or y, periodic images
/// included. Without such a plane, all columns are selected.
struct Near {
    const surface::Plane* plane;
    double distance;

    // By index of a cell along the axis: 1 if its columns are selected.
    std::vector<std::uint8_t> along(const Domain& domain, int axis) const {
        const auto a = static_cast<std::size_t>(axis);
        std::vector<std::uint8_t> near(static_cast<std::size_t>(domain.cells[a]), 1);
        if (plane == nullptr || plane->normal[(axis + 1) % 3] != 0.0 || plane->normal[(axis + 2) % 3] != 0.0)
            return near;
        const double at = plane->offset / plane->normal[axis], extent = domain.max[a] - domain.min[a];
        for (std::size_t i = 0; i < near.size(); ++i) {
            double off = std::abs(domain.min[a] + (static_cast<double>(i) + 0.5) * domain.spacing - at);
            if (domain.side[a] == Side::periodic) off = std::min(off, std::abs(extent - off));
            near[i] = off <= distance + 0.51 * domain.spacing;  // from the middle; margin for rounding
        }
        return near;
    }
};

/// The columns of cells that a level meshes, and those of them along the seam with the next finer level.
class LevelCells {
  public:
    // \param finer  the next finer level, or null.
    LevelCells(const MaterialStack& level, const MaterialStack* finer, const Near& near)
        : domain_(level.domain), finer_(finer ? &finer->columns : nullptr) {
        constexpr int kColumn = LevelColumns::kNodes / 2;  // cells under a finer level's column
        const auto [nx, ny] = domain_.cells;
        columns.resize(static_cast<std::size_t>(nx * ny), surface::CellColumn::left_out);
        const std::vector<std::uint8_t> near_x = near.along(domain_, 0), near_y = near.along(domain_, 1);
        for (int i = 0; i < nx; ++i) {
            if (near_x[static_cast<std::size_t>(i)] == 0) continue;
            for (int j = 0; j < ny; j += kColumn) {
                const bool own = !level.coarser || level.columns.of_node(i, j), finer = is_finer(i, j);
                for (int k = j; own && k < std::min(j + kColumn, ny); ++k)
                    if (near_y[static_cast<std::size_t>(k)] != 0)
                        columns[at(i, k)] = finer                 ? surface::CellColumn::bare
                                            : touches_finer(i, k) ? surface::CellColumn::vertices
                                                                  : surface::CellColumn::meshed;
            }
        }
    }
    std::size_t at(int i, int j) const { return static_cast<std::size_t>(i * domain_.cells[1] + j); }
    bool is_seam(int i, int j) const {
        return i >= 0 && j >= 0 && i < domain_.cells[0] && j < domain_.cells[1] &&
               columns[at(i, j)] == surface::CellColumn::vertices;
    }
    // Whether the finer level counts in a cell; indices beyond a periodic side are wrapped.
    bool is_finer(int i, int j) const {
        if (finer_ == nullptr) return false;
        for (int a = 0; a < 2; ++a) {
            int& n = a == 0 ? i : j;
            const int cells = domain_.cells[static_cast<std::size_t>(a)];
            if (domain_.side[static_cast<std::size_t>(a)] == Side::periodic) n = (n + cells) % cells;
            if (n < 0 || n >= cells) return false;
        }
        return finer_->of_coarser_node(i, j);
    }

    // By column of cells. Seam columns get vertices alone, and none on edges that finer cells share.
    std::vector<surface::CellColumn> columns;

  private:
    bool touches_finer(int i, int j) const {
        if (finer_ == nullptr) return false;
        for (int n = 0; n < 9; ++n)
            if (is_finer(i + n / 3 - 1, j + n % 3 - 1)) return true;
        return false;
    }

    const Domain& domain_;
    const LevelColumns* finer_;
};

}  // namespace sidewall::levelset
