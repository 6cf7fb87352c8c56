#pragma once
#include <filesystem>
#include <fstream>

#include "surface/files/mesh_io.hpp"
#include "tests/folder.hpp"

// A small folder like the ones that `run` writes.
namespace sidewall::test {

/// A surface of one material over [-1, 1]^2 that follows a profile of (x, z).
inline TriangleMesh profile_mesh(const std::vector<std::pair<double, double>>& profile, double material) {
    TriangleMesh mesh;
    constexpr int kRows = 8;
    const auto n = std::uint32_t(profile.size());
    for (int j = 0; j <= kRows; ++j)
        for (const auto& [x, z] : profile) mesh.vertices.emplace_back(x, 2.0 * j / kRows - 1.0, z);
    for (std::uint32_t j = 0; j < kRows; ++j)
        for (std::uint32_t i = 0; i + 1 < n; ++i) {
            const std::uint32_t a = j * n + i;
            mesh.triangles.push_back({a, a + 1, a + n + 1});
            mesh.triangles.push_back({a, a + n + 1, a + n});
        }
    mesh.triangle_attributes.push_back(
        {"material", 1, Scalar::int32, std::vector<double>(mesh.triangles.size(), material)});
    return mesh;
}

/// Si (0) with a trench |x| < 0.5, 1 deep, under 0.2 of SiO2 (1).
inline TriangleMesh trench_surface() {
    return profile_mesh({{-1, 0.2}, {-0.3, 0.2}, {-0.3, -0.8}, {0.3, -0.8}, {0.3, 0.2}, {1, 0.2}}, 1);
}
inline TriangleMesh trench_interface() {
    return profile_mesh({{-1, 0}, {-0.5, 0}, {-0.5, -1}, {0.5, -1}, {0.5, 0}, {1, 0}}, 0);
}

inline void write_result_folder(const std::filesystem::path& folder) {
    const surface::MeshMetadata metadata{{{"length_unit", "um"}, {"time_unit", "s"}}, {{"time", 5.0}}};
    surface::write_mesh(folder / "surface_0000.vtp", trench_interface(), metadata);
    TriangleMesh last = trench_surface();
    for (const char* name : {"flux_neutral", "rate"}) {
        last.triangle_attributes.push_back({name, 1, Scalar::float64, {}});
        for (std::size_t t = 0; t < last.triangles.size(); ++t)
            last.triangle_attributes.back().values.push_back(1.0 + triangle_centroid(last, t).z());
    }
    surface::write_mesh(folder / "surface_0001.vtp", last, metadata);
    surface::write_mesh(folder / "interface_0001_0.vtp", trench_interface(), metadata);
    std::ofstream(folder / "surface.pvd")
        << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\"><Collection>\n"
           "<DataSet timestep=\"0\" part=\"0\" file=\"surface_0000.vtp\"/>\n"
           "<DataSet timestep=\"5\" part=\"0\" file=\"surface_0001.vtp\"/>\n"
           "<DataSet timestep=\"5\" part=\"1\" file=\"interface_0001_0.vtp\"/>\n"
           "<DataSet timestep=\"5\" part=\"2\" file=\"traced_0001.vtp\"/>\n</Collection></VTKFile>\n";
    std::ofstream(folder / "summary.json")
        << R"({"version": "0.1.0", "recipe": "t.toml", "steps": [{"model": "isotropic"}],
        "timing": {"trace": 3.0, "total": 4.0}, "metrology": {"depth": 1.0}})";
}

}  // namespace sidewall::test
