// A mesh, in a file whose extension is what the program's name ends with: fuzz_mesh_ply reads .ply.
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "fuzz/target.hpp"
#include "io/mesh_io.hpp"

using namespace penumbra;
using fuzz::expect;

namespace {

// In a folder of its own, where a mesh finds no companions; gone at the end.
class File {
public:
    File() : folder_(std::filesystem::temp_directory_path() / ("penumbra-fuzz-" + std::to_string(::getpid())))
    {
        std::filesystem::create_directories(folder_);
    }
    ~File()
    {
        std::error_code ignored;
        std::filesystem::remove_all(folder_, ignored);
    }
    std::string write(std::string_view text) const
    {
        const std::string program = program_invocation_short_name;
        const std::string path = (folder_ / ("mesh." + program.substr(program.rfind('_') + 1))).string();
        std::ofstream out(path, std::ios::binary | std::ios::trunc);
        out.write(text.data(), static_cast<std::streamsize>(text.size()));
        expect(static_cast<bool>(out.flush()), "cannot write " + path);
        return path;
    }

private:
    std::filesystem::path folder_;
};

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static const File file;
    const std::string path = file.write(fuzz::text_of(data, size));
    TriangleMesh mesh;
    if (!fuzz::accepted([&] { mesh = read_mesh(path, "mesh"); })) return 0;

    expect(!mesh.triangles.empty(), "a mesh without triangles");
    std::vector<bool> used(mesh.positions.size());
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t corner : triangle) {
            expect(corner < mesh.positions.size(), "a triangle with a corner elsewhere");
            used[corner] = true;
        }
    for (std::size_t i = 0; i < used.size(); ++i) {
        expect(used[i], "a vertex that no triangle uses");
        for (int axis = 0; axis < 3; ++axis) expect(std::isfinite(mesh.positions[i][axis]), "a vertex that is not finite");
    }
    return 0;
}
