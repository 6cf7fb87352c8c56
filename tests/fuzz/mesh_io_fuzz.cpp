// libFuzzer: the first byte picks a mesh file format, the others are the file. Readers refuse it with a
// FileError or keep what read_mesh promises.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "surface/error.hpp"
#include "surface/mesh_io.hpp"

using namespace sidewall;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
    try {
        const TriangleMesh mesh = data[0] % 4 == 0   ? surface::decode_vtp(bytes, "fuzz")
                                  : data[0] % 4 == 1 ? surface::decode_ply(bytes, "fuzz")
                                  : data[0] % 4 == 2 ? surface::decode_stl(bytes, "fuzz")
                                                     : surface::decode_obj(bytes, "fuzz");
        if (mesh.triangles.empty()) std::abort();
        for (const Triangle& t : mesh.triangles)
            for (const std::uint32_t v : t)
                if (v >= mesh.vertices.size()) std::abort();
        for (const Attribute& a : mesh.triangle_attributes)
            if (a.values.size() != static_cast<std::size_t>(a.components) * mesh.triangles.size())
                std::abort();
    } catch (const FileError&) {
    }
    return 0;
}
