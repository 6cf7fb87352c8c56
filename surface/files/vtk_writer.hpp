#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "surface/files/mesh_metadata.hpp"
#include "surface/triangle_mesh.hpp"

// Common parts of VTK's XML files; internal to the mesh writers.
namespace sidewall::surface {

/// Builds a VTK XML file from XML text and appended, compressed data arrays.
class VtkWriter {
  public:
    std::string xml;  ///< text after the last array, to which callers append

    explicit VtkWriter(std::string type);
    void array(const char* type, std::string_view name, int components, std::string bytes);
    void attributes(const char* element, const std::vector<Attribute>& attributes);
    void field_data(const MeshMetadata& metadata);
    void points(const std::vector<Vec3>& vertices);
    /// The complete file. Call it once, at the end.
    std::string file();

  private:
    void compress();  // moves waiting_ to appended_

    std::string type_;
    std::vector<std::string> heads_;    // parts of the XML, each up to an array's offset
    std::vector<std::size_t> offsets_;  // starts of compressed arrays in appended_
    std::vector<std::string> waiting_;  // bytes of arrays to be compressed
    std::size_t waiting_bytes_ = 0;
    std::string appended_;
};

/// Escapes a text for the value of an XML attribute.
std::string xml_escape(std::string_view text);

}  // namespace sidewall::surface
