#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surface/vec3.hpp"

namespace sidewall {

/// Three vertex indices, counter-clockwise seen from outside the material.
using Triangle = std::array<std::uint32_t, 3>;

/// How an attribute's values are stored in a file.
enum class Scalar { float32, float64, int32 };

/// A named value per vertex or per triangle.
struct Attribute {
    std::string name;
    int components = 1;  ///< values per element
    Scalar type = Scalar::float64;
    std::vector<double> values;  ///< components * elements, element by element
};

/// Reduces an attribute to the values of the given elements, in the given order.
void take_elements(Attribute& attribute, std::span<const std::uint32_t> elements);

/// A triangle surface on plain arrays. World units; normals point out of the material.
struct TriangleMesh {
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;
    std::vector<Attribute> vertex_attributes;
    std::vector<Attribute> triangle_attributes;

    /// The attribute of that name, or nullptr.
    const Attribute* vertex_attribute(std::string_view name) const;
    const Attribute* triangle_attribute(std::string_view name) const;
};

/// Axis-aligned box, world units.
struct Box3 {
    Vec3 min = Vec3::Constant(kInfinity);
    Vec3 max = Vec3::Constant(-kInfinity);
    void extend(const Vec3& p) {
        min = min.cwiseMin(p);
        max = max.cwiseMax(p);
    }
    void extend(const Box3& box) { extend(box.min), extend(box.max); }
    Vec3 size() const { return max - min; }
};

/// Whether two boxes have a point in common.
bool overlap(const Box3& a, const Box3& b);

/// Bounding box of all vertices; inverted (min > max) for an empty mesh.
Box3 bounding_box(const TriangleMesh& mesh);

/// Cross product of two edges: twice the area times the unit normal. Zero for a degenerate triangle.
Vec3 area_vector(const TriangleMesh& mesh, std::size_t triangle);

double triangle_area(const TriangleMesh& mesh, std::size_t triangle);
Vec3 triangle_centroid(const TriangleMesh& mesh, std::size_t triangle);

/// Unit normal of every triangle; the zero vector where the area vanishes.
std::vector<Vec3> triangle_normals(const TriangleMesh& mesh);

/// Sum of all triangle areas, length unit squared.
double total_area(const TriangleMesh& mesh);

/// Signed volume of a closed mesh (divergence theorem), positive if normals point outwards.
double enclosed_volume(const TriangleMesh& mesh);

}  // namespace sidewall
