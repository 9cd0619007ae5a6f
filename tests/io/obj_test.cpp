#include "io/mesh_io.hpp"
#include "io/obj.hpp"
#include "io/support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

PolygonSoup read(const std::string& text, const std::map<std::string, std::string>& files = {},
                 std::vector<std::string>* warnings = nullptr)
{
    MeshSource source{.where = "x.obj", .companion = {}, .warnings = warnings};
    source.companion = [&](const std::string& name) {
        if (!files.contains(name)) throw Error(ErrorCode::not_found, name + ": no such file");
        return Bytes(bytes_of(files.at(name)));
    };
    return decode_obj(bytes_of(text), source);
}

const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

// A picture of 2 x 1: the left texel `left`, the right one 1.
std::string picture(float left, int channels = 1)
{
    Image image{.width = 2, .height = 1, .channels = channels, .pixels = {}};
    for (const float value : {left, 1.0f})
        for (int c = 0; c < channels; ++c) image.pixels.push_back(c == 3 ? value : channels == 4 ? 0.25f : value);
    const std::vector<std::byte> bytes = encode_image(image, {"png", 8});
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

} // namespace

TEST(Obj, ReadsWhatProgramsWrite)
{
    const PolygonSoup soup = read(
        "\xef\xbb\xbf# a comment\r\nmtllib\r\no thing\r\nv 0 0 0 1\r\nv +2 0 0 2\r\nv 0 1e0 0 .5 .5 .5 # coloured\r\nvn 0 0 1\r\nvt 0 0\r\n"
        "s off\r\nf 1/1/1 2//1 \\\r\n 3/1\r\nf -3 -2 -1\r\nl 1 2\r\np 1\r\n");
    EXPECT_EQ(soup.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(soup.corners, (std::vector<std::uint32_t>{0, 1, 2, 0, 1, 2}));
    EXPECT_EQ(soup.sizes, (std::vector<std::uint32_t>{3, 3}));
    EXPECT_EQ(soup.lines, 2u);
    EXPECT_EQ(read("v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3").sizes.size(), 1u) << "lines that CR alone ends";
}

TEST(Obj, ErrorsNameTheLine)
{
    const auto says = [](const std::string& text, const std::string& what) {
        const Error error = error_of([&] { read(text); });
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_NE(error.message().find(what), std::string::npos) << error.message();
    };
    says(corners + "f 1 2 4\n", "line 4 has a face with vertex 4 of 3");
    says(corners + "f 1 2 0\n", "line 4 has a face with vertex 0 of 3");
    says(corners + "f 1 2 -4\n", "line 4 has a face with vertex -4 of 3");
    says(corners + "f 1 2 x\n", "line 4 has a face with vertex \"x\"");
    says(corners + "f 1 2 \xff\n", "line 4 has a face with vertex \"\\ufffd\"");
    says("v 1 2\n", "line 1 has a vertex without three numbers");
    says("\nv 1,5 2 3\n", "line 2 has a vertex without three numbers");
    says(corners + "f 1 2 99999999999999999999\n", "vertex \"99999999999999999999\"");
}

TEST(Obj, OpacityMapsCutOut)
{
    const std::string mesh =
        "mtllib my leaves.mtl\n" + corners + "vt 0 0\nvt 1 0\nvt 0 1\nusemtl leaf\nf 1/1 2/2 3/3\nusemtl bark\nf 1/1 2/2 3/3\n";
    const std::string library = "newmtl bark\nKd 1 1 1\nnewmtl leaf\nmap_d -clamp on -s 2 1 1 tex\\leaf mask.png\n";
    for (const int channels : {1, 3, 4}) {
        std::vector<std::string> warnings;
        const PolygonSoup soup = read(mesh, {{"my leaves.mtl", library}, {"tex/leaf mask.png", picture(0, channels)}}, &warnings);
        ASSERT_EQ(soup.cuts.size(), 1u) << channels;
        EXPECT_EQ(soup.cut, (std::vector<std::uint32_t>{0, not_cut}));
        EXPECT_EQ(soup.cuts[0].alpha.pixels, (std::vector<float>{0, 1})) << channels;
        EXPECT_EQ(soup.cuts[0].cutoff, 0.5f);
        EXPECT_EQ(soup.cuts[0].beyond_u, CutOut::Beyond::clamp);
        EXPECT_EQ(soup.texture[1], Imath::V2f(2, 1)) << "scaled, and v goes down in images";
        EXPECT_EQ(soup.texture[2], Imath::V2f(0, 0));
        EXPECT_TRUE(warnings.empty());
    }
    // What hides nothing is no cut-out.
    EXPECT_TRUE(read(mesh, {{"my leaves.mtl", library}, {"tex/leaf mask.png", picture(1)}}).cuts.empty());
}

TEST(Obj, MaterialsThatAreNotThereAreWarnedOf)
{
    std::vector<std::string> warnings;
    EXPECT_EQ(read("mtllib gone.mtl\n" + corners + "f 1 2 3\n", {}, &warnings).sizes.size(), 1u);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("gone.mtl"), std::string::npos);
    warnings.clear();
    read("mtllib a.mtl\nvt 0 0\n" + corners + "usemtl a\nf 1/1 2/1 3/1\n", {{"a.mtl", "newmtl a\nmap_d gone.png\n"}}, &warnings);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("gone.png"), std::string::npos);
}

// Coordinates of a survey: float32 has steps of half a unit there.
TEST(Obj, FarCoordinatesKeepTheirDigitsUntilTheyArePlaced)
{
    const Folder folder;
    const std::string far = "4500000.125 5300000.25 100.0625",
                      text = "v " + far + "\nv 4500000.25 5300000.25 100.0625\nv 4500000.125 5300000.375 100.0625\nf 1 2 3\n";
    MeshOptions options;
    options.placement.translation = {-4500000, -5300000, -100};
    std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n4500000.125 5300000.25 100.0625\n4500000.25 5300000.25 100.0625\n"
        "4500000.125 5300000.375 100.0625\n3 0 1 2\n";
    std::string stl =
        "SOLID survey vertex\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 4500000.125 5300000.25 100.0625\nVERTEX 4500000.25 5300000.25 "
        "100.0625\nVERTEX 4500000.125 5300000.375 100.0625\nENDLOOP\nENDFACET\nENDSOLID\n";
    std::vector<std::string> warnings;
    options.warnings = &warnings;
    for (const std::string& path : {folder.write("a.obj", text), folder.write("a.ply", ply), folder.write("a.stl", stl)}) {
        SCOPED_TRACE(path);
        const TriangleMesh mesh = read_mesh(path, "x", options);
        EXPECT_EQ(mesh.positions, (std::vector<Imath::V3f>{{0.125f, 0.25f, 0.0625f}, {0.25f, 0.25f, 0.0625f}, {0.125f, 0.375f, 0.0625f}}));
    }
    EXPECT_TRUE(warnings.empty()) << warnings[0];
    options.placement.translation = {0, 0, 0};
    read_mesh(folder.write("a.obj", "v 4500000 5300000 100\nv 4500020 5300000 100\nv 4500000 5300020 100\nf 1 2 3\n"), "x", options);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("steps of 0.5"), std::string::npos) << warnings[0];
}
