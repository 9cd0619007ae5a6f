// Where the files lie that a mesh of a scene names.
#include "io/gltf_support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

class MeshCompanions : public ::testing::Test {
protected:
    MeshCompanions()
    {
        Gltf gltf;
        const int positions = gltf.accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
        gltf.node({{"mesh", gltf.mesh({{"attributes", {{"POSITION", positions}}}})}});
        folder.write("triangle.gltf", gltf.text("my%20mesh.bin"));
        folder.write("elsewhere.bin", gltf.bytes());
    }
    Scene load(const std::string& more) const
    {
        const std::string before = R"({"penumbra": 1, "light": {"kind": "point", "center": [0, 6, 0]}, "objects": [{"mesh": "triangle.gltf")";
        return load_scene(folder.write("scene.json", before + more + "}]}"));
    }
    const Folder folder;
};

TEST_F(MeshCompanions, LieWhereFilesSays)
{
    const Scene scene = load(R"(, "files": {"my mesh.bin": "elsewhere.bin", "another": "none"})");
    EXPECT_EQ(scene.objects.at(0).mesh.positions.size(), 3u);
}

TEST_F(MeshCompanions, FilesNamesThemAll)
{
    for (const std::string more : {"", R"(, "files": {})", R"(, "files": {"my%20mesh.bin": "elsewhere.bin"})", R"(, "files": {"my mesh.bin": "none"})"}) {
        const Error error = error_of([&] { load(more); });
        EXPECT_EQ(error.code(), ErrorCode::not_found) << more;
        EXPECT_MENTIONS(error, "triangle.gltf names \"my mesh.bin\"");
    }
}

TEST_F(MeshCompanions, FilesAreAnObjectOfNames)
{
    for (const std::string wrong : {"3", "[]", R"({"a": 3})", R"({"a": ""})"}) {
        const Error error = error_of([&] { load(R"(, "files": )" + wrong); });
        EXPECT_EQ(error.code(), ErrorCode::invalid_input) << wrong;
        EXPECT_MENTIONS(error, "objects[0].files");
    }
}

} // namespace
