#include "flux/radiosity/ray_densities.hpp"

#include <cmath>
#include <numeric>

#include "flux/radiosity/exchange_samples.hpp"
#include "surface/turn.hpp"

namespace sidewall::flux {
namespace {

// Shares of connections aimed at the source plane and at relays; the others aim at the surface by area.
constexpr double kPlaneShare = 1.0 / 3.0, kRelayShare = 1.0 / 3.0;
// Consecutive triangles of the curve over which counts of the pilot are averaged.
constexpr std::size_t kRelayRun = 64;

// The lowest 20 bits of \p word, two zeros after each.
std::uint64_t spread_bits(std::uint64_t word) {
    std::uint64_t spread = 0;
    for (unsigned bit = 0; bit < 20; ++bit) spread |= (word >> bit & 1u) << 3 * bit;
    return spread;
}

// Triangles in the order of a Morton curve through their centroids. Neighbours on it are neighbours in space:
// consecutive rays visit nearby nodes of the hierarchy, and each region gets well spread directions.
std::vector<std::uint32_t> along_curve(const TriangleMesh& mesh, const Box3& bounds) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(mesh.triangles.size());
    const double scale = 1048575.0 / std::max(bounds.size().maxCoeff(), 1e-300);
    for (std::size_t t = 0; t < keys.size(); ++t) {
        const Vec3 p = scale * (triangle_centroid(mesh, t) - bounds.min);
        std::uint64_t key = 0;
        for (int axis = 0; axis < 3; ++axis)
            key |= spread_bits(static_cast<std::uint64_t>(std::max(0.0, p[axis]))) << axis;
        keys[t] = {key, static_cast<std::uint32_t>(t)};
    }
    std::sort(keys.begin(), keys.end());
    std::vector<std::uint32_t> order(keys.size());
    std::transform(keys.begin(), keys.end(), order.begin(), [](const auto& key) { return key.second; });
    return order;
}

}  // namespace

void Distribution::assign(std::vector<double> weights) {
    cumulative_.resize(weights.size() + 1);
    cumulative_[0] = 0.0;
    std::partial_sum(weights.begin(), weights.end(), cumulative_.begin() + 1);
    total_ = cumulative_.back();
    guide_.resize(weights.size() + 1);
    std::size_t item = 0;
    for (std::size_t part = 0; part < guide_.size(); ++part) {
        const double at = total_ * static_cast<double>(part) / static_cast<double>(weights.size());
        while (item + 1 < weights.size() && cumulative_[item + 1] <= at) ++item;
        guide_[part] = static_cast<std::uint32_t>(item);
    }
}

Distribution::Pick Distribution::pick(double u) const {
    const std::size_t items = cumulative_.size() - 1;
    const double at = u * total_;
    std::size_t item = guide_[std::min(static_cast<std::size_t>(u * static_cast<double>(items)), items)];
    while (item > 0 && cumulative_[item] > at) --item;
    while (item + 1 < items && cumulative_[item + 1] <= at) ++item;
    const double width = cumulative_[item + 1] - cumulative_[item];
    return {item, width > 0.0 ? std::clamp((at - cumulative_[item]) / width, 0.0, 1.0 - 1e-9) : 0.5};
}

RayDensities::RayDensities(const Geometry& geometry, const ProfileUnknowns& profile,
                           std::vector<double> exponents)
    : box_(geometry.box), top_(geometry.top), exponents_(std::move(exponents)), partner_(profile.partner) {
    const TriangleMesh& mesh = geometry.mesh;
    const Wedges& wedges = profile.unknowns;
    for (const double exponent : exponents_) lobes_.push_back(lobe_scale(exponent));
    facets_.resize(mesh.triangles.size());
    for (std::size_t t = 0; t < facets_.size(); ++t) {
        const auto vertex = [&](std::size_t k) -> Vec3 {
            return mesh.vertices[mesh.triangles[t][k]].cast<float>().cast<double>();
        };
        Facet& facet = facets_[t];
        facet.corner = vertex(0);
        facet.edge1 = vertex(1) - vertex(0);
        facet.edge2 = vertex(2) - vertex(0);
        facet.normal = area_vector(mesh, t).normalized();
        facet.area = triangle_area(mesh, t);
    }
    // A sector is a share of the full turn. A connection ends at any azimuth, so its density is that share.
    if (round())
        image_share_[image_share_.size() / 2] = share_of_turn(box_.max[1] - box_.min[1], box_.max[0]);
    order_ = along_curve(mesh, bounding_box(mesh));
    item_of_.resize(order_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) item_of_[order_[i]] = static_cast<std::uint32_t>(i);
    // Every wedge gets equally many rays, spread over its triangles by area.
    even_share_.assign(facets_.size(), 0.0);
    double wedges_used = 0.0;
    for (const double area : wedges.area) wedges_used += area > 0.0 ? 1.0 : 0.0;
    for (std::size_t t = 0; t < facets_.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
            if (facets_[t].area > 0.0)
                even_share_[t] +=
                    facets_[t].area / (3.0 * wedges.area[wedges.corner[3 * t + k]] * wedges_used);
    set_starts({});
    opening_.assign(kCells * kCells, 1.0 / static_cast<double>(kCells * kCells));
    if (!round()) image_share_[image_share_.size() / 2] = 1.0;
    images_.assign({image_share_.begin(), image_share_.end()});
    make_targets();
    cosine_density_.assign(facets_.size(), 0.0);
    start_density_.assign(facets_.size(), 0.0);
}

void RayDensities::set_starts(std::span<const double> variance) {
    start_share_ = even_share_;
    // Average over runs of neighbours: the variance of a single triangle is mostly noise.
    constexpr std::size_t kRun = 16;
    std::vector<double> best(order_.size(), 0.0);
    double total = 0.0;
    for (std::size_t first = 0; first < order_.size() && !variance.empty(); first += kRun) {
        const std::size_t last = std::min(first + kRun, order_.size());
        double even = 0.0, spread = 0.0;
        for (std::size_t i = first; i < last; ++i) {
            even += even_share_[order_[i]];
            spread += variance[order_[i]];
        }
        if (!(even > 0.0)) continue;
        const double ratio = std::sqrt(spread / even);  // root of the variance of one ray
        for (std::size_t i = first; i < last; ++i) best[i] = ratio * even_share_[order_[i]];
        total += ratio * even;
    }
    for (std::size_t i = 0; i < order_.size() && total > 0.0; ++i)
        start_share_[order_[i]] = 0.5 * even_share_[order_[i]] + 0.5 * best[i] / total;
    // In a profile, spread the rays of a segment evenly over both its triangles.
    for (std::uint32_t t = 0; t < partner_.size(); ++t) {
        const std::uint32_t other = partner_[t];
        if (other < t) continue;
        const double share =
            (start_share_[t] + start_share_[other]) / (facets_[t].area + facets_[other].area);
        start_share_[t] = share * facets_[t].area, start_share_[other] = share * facets_[other].area;
    }
    std::vector<double> weights(order_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) weights[i] = start_share_[order_[i]];
    starts_.assign(std::move(weights));
}

void RayDensities::make_targets() {
    double area = 0.0;
    for (const Facet& facet : facets_) area += facet.area;
    // The sky seen by rings comes from sky_of_rings(): no connection needs to aim at the source plane.
    const double plane = round() ? 0.0 : kPlaneShare, relayed = relay_.empty() ? 0.0 : kRelayShare,
                 even = 1.0 - plane - relayed;
    target_density_.assign(facets_.size(), even / area);
    std::vector<double> weights(order_.size() + opening_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) {
        const std::uint32_t t = order_[i];
        if (relayed > 0.0 && facets_[t].area > 0.0)
            target_density_[t] += relayed * relay_[i] / facets_[t].area;
    }
    // In a profile both triangles of a facet need the same density, because a path may end on either.
    if (!partner_.empty())
        for (std::uint32_t t = 0; t < partner_.size(); ++t)
            if (const std::uint32_t other = partner_[t]; t < other)
                target_density_[t] = target_density_[other] =
                    0.5 * (target_density_[t] + target_density_[other]);
    for (std::size_t i = 0; i < order_.size(); ++i)
        weights[i] = target_density_[order_[i]] * facets_[order_[i]].area;
    cell_density_.resize(opening_.size());
    const double cell_area = box_.area() / static_cast<double>(opening_.size());
    for (std::size_t i = 0; i < opening_.size(); ++i) {
        weights[order_.size() + i] = plane * opening_[i];
        cell_density_[i] = plane * opening_[i] / cell_area;
    }
    targets_.assign(std::move(weights));
}

std::vector<double> RayDensities::share_kept(std::span<const double> started,
                                             std::span<const double> kept) const {
    std::vector<double> share(order_.size(), 0.0);
    for (std::size_t first = 0; first < share.size(); first += kRelayRun) {
        const std::size_t last = std::min(first + kRelayRun, share.size());
        double from = 0.0, stay = 0.0;
        for (std::size_t i = first; i < last; ++i) {
            from += started[i];
            stay += kept[i];
        }
        for (std::size_t i = first; i < last && from > 0.0; ++i) share[i] = stay / from;
    }
    return share;
}

void RayDensities::set_relays(std::span<const double> lit, std::span<const double> kept) {
    relay_.assign(order_.size(), 0.0);
    double total = 0.0;
    for (std::size_t first = 0; first < order_.size(); first += kRelayRun) {
        const std::size_t last = std::min(first + kRelayRun, order_.size());
        double light = 0.0, area = 0.0;
        for (std::size_t i = first; i < last; ++i) {
            light += lit[i];
            area += facets_[order_[i]].area;
        }
        if (!(area > 0.0)) continue;
        const double relay = light * kept[first];
        total += relay;
        for (std::size_t i = first; i < last; ++i) relay_[i] = relay * facets_[order_[i]].area / area;
    }
    if (!(total > 0.0)) relay_.clear();
    for (double& share : relay_) share /= total;
    make_targets();
}

void RayDensities::set_counts(const RayCounts& counts) {
    counts_ = counts;
    for (std::size_t t = 0; t < facets_.size(); ++t) {
        if (!(facets_[t].area > 0.0)) continue;
        const double share = start_share_[t] / facets_[t].area;
        cosine_density_[t] = counts.cosine * share;
        start_density_[t] = counts.connect * share;
    }
}

void RayDensities::set_images(std::span<const double> hits) {
    if (round()) return;
    // Both ends of a pair must find the same share. Seen from the other end, an image lies in the opposite
    // direction, or in the same direction if it is mirrored.
    const auto from_other_end = [this](int k, int axis) {
        return box_.boundary[axis] == Boundary::reflective && k % 2 != 0 ? k : -k;
    };
    double total = 0.0;
    for (std::size_t i = 0; i < image_share_.size(); ++i) {
        const int x = from_other_end(static_cast<int>(i) % kImageRow - kImages, 0),
                  y = from_other_end(static_cast<int>(i) / kImageRow - kImages, 1);
        const int other = (y + kImages) * kImageRow + x + kImages;
        image_share_[i] = 0.5 * (hits[i] + hits[static_cast<std::size_t>(other)]);
        total += image_share_[i];
    }
    if (!(total > 0.0)) image_share_[image_share_.size() / 2] = total = 1.0;
    for (double& share : image_share_) share /= total;
    images_.assign({image_share_.begin(), image_share_.end()});
}

void RayDensities::set_openings(std::span<const double> exits) {
    // A tenth is spread evenly: the pilot may have missed cells.
    const double total = std::accumulate(exits.begin(), exits.end(), 0.0);
    const double even = 1.0 / static_cast<double>(opening_.size());
    for (std::size_t i = 0; i < opening_.size(); ++i)
        opening_[i] = total > 0.0 ? 0.1 * even + 0.9 * exits[i] / total : even;
    make_targets();
}

int RayDensities::image_of(const Vec3& point) const {
    if (round())
        return point.head<2>().norm() <= box_.max[0] ? static_cast<int>(image_share_.size() / 2) : kNoImage;
    int image = 0;
    for (int axis = 1; axis >= 0; --axis) {
        double k = 0.0;
        if (box_.boundary[axis] != Boundary::open)
            k = std::floor((point[axis] - box_.min[axis]) / (box_.max[axis] - box_.min[axis]));
        if (!(std::abs(k) <= kImages)) return kNoImage;
        image = image * kImageRow + static_cast<int>(k) + kImages;
    }
    return image;
}

Vec3 RayDensities::unfolded(Vec3 point, int image) const {
    for (int axis = 0; axis < 2; ++axis) {
        const int k = (axis == 0 ? image % kImageRow : image / kImageRow) - kImages;
        const double width = box_.max[axis] - box_.min[axis], low = box_.min[axis] + k * width;
        const double within = point[axis] - box_.min[axis];
        const bool mirrored = box_.boundary[axis] == Boundary::reflective && k % 2 != 0;
        point[axis] = low + (mirrored ? width - within : within);
    }
    return point;
}

RayDensities::Target RayDensities::target(double which, double along, double image) const {
    const Distribution::Pick pick = targets_.pick(which);
    Target target{{}, {}, surface::kNoTriangle, static_cast<int>(images_.pick(image).item)};
    Vec3 point;
    if (pick.item < order_.size()) {
        target.triangle = order_[pick.item];
        const Facet& facet = facets_[target.triangle];
        const double root = std::sqrt(pick.rest);
        point = facet.corner + root * (1.0 - along) * facet.edge1 + root * along * facet.edge2;
        target.normal = facet.normal;
    } else {
        const std::size_t cell = pick.item - order_.size();
        const double step[2] = {(box_.max[0] - box_.min[0]) / kCells, (box_.max[1] - box_.min[1]) / kCells};
        const std::size_t column = cell % kCells, row = cell / kCells;
        point = {box_.min[0] + (static_cast<double>(column) + pick.rest) * step[0],
                 box_.min[1] + (static_cast<double>(row) + along) * step[1], top_};
        target.normal = -Vec3::UnitZ();
    }
    if (round()) {
        const double turn = 2.0 * std::numbers::pi * image, across = target.normal.x();
        target.point = {point.x() * std::cos(turn), point.x() * std::sin(turn), point.z()};
        target.normal = {across * std::cos(turn), across * std::sin(turn), target.normal.z()};
        return target;
    }
    target.point = unfolded(point, target.image);
    for (int axis = 0; axis < 2; ++axis) {
        const int k = (axis == 0 ? target.image % kImageRow : target.image / kImageRow) - kImages;
        if (box_.boundary[axis] == Boundary::reflective && k % 2 != 0)
            target.normal[axis] = -target.normal[axis];
    }
    return target;
}

std::size_t RayDensities::cell_of(const Vec3& point) const {
    std::size_t cell = 0;
    for (int axis = 1; axis >= 0; --axis) {
        const double width = box_.max[axis] - box_.min[axis];
        double part = (point[axis] - box_.min[axis]) / width;
        const double k = std::floor(part);
        part -= k;
        if (box_.boundary[axis] == Boundary::reflective && std::fmod(k, 2.0) != 0.0) part = 1.0 - part;
        const double at = std::clamp(part * kCells, 0.0, kCells - 1.0);
        cell = cell * kCells + static_cast<std::size_t>(at);
    }
    return cell;
}

double RayDensities::exit_weight(std::uint32_t a, const Vec3& point, int image, double form,
                                 double cosine) const {
    double density = cosine_density_[a];
    const double source = counts_.source / box_.area();
    for (std::size_t i = 0; i < lobes_.size(); ++i)
        density += source * lobes_[i] * lobe(exponents_[i], cosine);
    if (image != kNoImage)
        density += start_density_[a] * cell_density_[cell_of(point)] *
                   image_share_[static_cast<std::size_t>(image)] * form;
    return 1.0 / density;
}

}  // namespace sidewall::flux
