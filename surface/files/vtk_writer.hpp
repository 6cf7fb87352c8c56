#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

// What VTK's XML files have in common; not for others.
namespace sidewall::surface {

/// Collects the XML head and the appended data side by side.
class VtkWriter {
  public:
    std::string xml;  ///< to be added to between arrays

    explicit VtkWriter(std::string type);
    void array(const char* type, std::string_view name, int components, std::string bytes);
    void attributes(const char* element, const std::vector<Attribute>& attributes);
    void field_data(const MeshMetadata& metadata);
    void points(const std::vector<Vec3>& vertices);
    /// The whole file, once.
    std::string file();

  private:
    void compress();  // what waits

    std::string type_;
    std::vector<std::string> heads_;    // of the XML, each up to an array's offset
    std::vector<std::size_t> offsets_;  // of the arrays that are compressed
    std::vector<std::string> waiting_;  // the others' bytes
    std::size_t waiting_bytes_ = 0;
    std::string appended_;
};

/// Text as it may stand between the quotes of an attribute.
std::string xml_escape(std::string_view text);

}  // namespace sidewall::surface
