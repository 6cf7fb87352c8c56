#pragma once
#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"

namespace sidewall::levelset {

struct Band;

/// Gives the nodes of leaves that the growing band has made the side of the front that their neighbours lie on, and the
/// value of the band's edge. Until then they hold the value of the tile they replace, whose sign means nothing.
/// \note Parallel; the same bits on any number of threads.
void sign_new_leaves(const Band& band, const Grid& grid, const Domain& domain);

}  // namespace sidewall::levelset
