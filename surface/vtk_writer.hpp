#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "surface/mesh_io.hpp"

// What VTK's XML files have in common; not for others.
namespace sidewall::surface {

/// Collects the XML head and the appended data side by side.
struct VtkWriter {
    std::string xml, appended;

    explicit VtkWriter(std::string_view type);
    void array(const char* type, std::string_view name, int components, std::string_view bytes);
    void attributes(const char* element, const std::vector<Attribute>& attributes);
    void field_data(const MeshMetadata& metadata);
    void points(const std::vector<Vec3>& vertices);
    /// The whole file. \param type  as given at the start.
    std::string file(std::string_view type) const;
};

/// Text as it may stand between the quotes of an attribute.
std::string xml_escape(std::string_view text);

}  // namespace sidewall::surface
