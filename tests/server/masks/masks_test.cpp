// Good requests: every format in and out, the library's bits, many clients at once.
#include <future>
#include <span>

#include "io/image_io.hpp"
#include "masks/masks.hpp"
#include "server/client.hpp"

namespace penumbra::test {
namespace {

// What the library computes by itself from the same scene and images.
Image library_mask(const Parts& all)
{
    static const Engine engine;
    return engine.mask(parse_scene(all.front().second, PartResources(all))).visibility;
}

std::vector<float> pixels_of(std::string_view file)
{
    return decode_image(std::as_bytes(std::span(file.data(), file.size())), "reply").pixels;
}

struct Format {
    const char *accept, *type, *format;
    int bits;
};
constexpr std::array formats{Format{"", "image/png", "png", 16},
                             Format{"image/png", "image/png", "png", 16},
                             Format{"image/x-exr", "image/x-exr", "exr", 32},
                             Format{"image/tiff", "image/tiff", "tif", 32},
                             Format{"image/x-portable-floatmap", "image/x-portable-floatmap", "pfm", 32},
                             Format{"text/html, image/*;q=0.5, image/x-exr;q=0.4", "image/png", "png", 16}};

TEST(Masks, EveryAcceptGivesTheLibrarysMask)
{
    const Image expected = library_mask(parts());
    EXPECT_NE(hash_of(expected.pixels), hash_of(std::vector<float>(expected.pixels.size(), 1))); // there is a shadow
    for (const Format& format : formats) {
        const std::string accept = *format.accept ? "Accept: " + std::string(format.accept) + "\r\n" : "";
        const Reply reply = ask(shared_port(), post(form(parts()), accept));
        ASSERT_EQ(reply.status, 200) << reply.head << reply.body;
        EXPECT_EQ(reply.header("Content-Type"), format.type);
        EXPECT_TRUE(reply.body == text_of(encode_image(expected, {format.format, format.bits}))) << format.accept;
        for (const char* stage : {"upload;dur=", "queue;dur=", "decode;dur=", "prepare;dur=", "shade;dur=", "encode;dur="})
            EXPECT_TRUE(holds(reply.header("Server-Timing"), stage)) << stage << " in " << reply.header("Server-Timing");
    }
}

TEST(Masks, BitsOfTheScenesOutputCountWhereItsFormatIsSent)
{
    nlohmann::json scene = scene_json();
    scene["output"] = {{"format", "png"}, {"bits", 8}};
    const Image expected = library_mask(parts());
    EXPECT_EQ(pixels_of(ask(shared_port(), post(form(parts(scene)))).body), pixels_of(text_of(encode_image(expected, {"png", 8}))));
    EXPECT_EQ(pixels_of(ask(shared_port(), post(form(parts(scene)), "Accept: image/x-exr\r\n")).body), expected.pixels);
}

TEST(Masks, EveryInputFormatGivesTheSameMask)
{
    const Image expected = library_mask(parts());
    for (const Format& format :
         {Format{"", "", "exr", 32}, Format{"", "", "tif", 32}, Format{"", "", "pfm", 32}, Format{"", "", "png", 16}}) {
        // Integers: 0 to 3 in 65535 steps; nothing is 0.
        const bool whole = std::string_view(format.format) == "png";
        nlohmann::json scene = scene_json();
        if (whole)
            for (const char* section : {"occluders", "receivers"})
                scene[section]["encoding"] = {{"kind", "normalized"}, {"near", 0}, {"far", 3}, {"empty", 0}};
        const auto encoded = [&](const DepthMap& map) {
            return text_of(encode_image(image_of(map, whole ? 0.0f : 1e30f, whole ? 3.0f : 1.0f), {format.format, format.bits}));
        };
        const Parts all{{"scene", scene.dump()}, {"front.exr", encoded(occluder_depth())}, {"floor.exr", encoded(receiver_depth())}};
        const Reply reply = ask(shared_port(), post(form(all), "Accept: image/x-portable-floatmap\r\n"));
        ASSERT_EQ(reply.status, 200) << format.format << reply.body;
        // Integer depths have a bias of their own precision: those masks are compared with the library's own of the same parts.
        EXPECT_TRUE(reply.body == text_of(encode_image(whole ? library_mask(all) : expected, {"pfm", 32}))) << format.format;
    }
}

TEST(Masks, WarningsStandInAHeader)
{
    Parts all = parts();
    all[1].second = text_of(encode_depth(flat(side, side, nothing_there)));
    const Reply reply = ask(shared_port(), post(form(all)));
    ASSERT_EQ(reply.status, 200) << reply.body;
    EXPECT_TRUE(nlohmann::json::parse(reply.header("Penumbra-Warnings")).is_array());
    EXPECT_TRUE(holds(reply.header("Penumbra-Warnings"), "nothing casts shadows"));
}

TEST(Masks, ManyClientsGetTheSameBitsBesideBadRequests)
{
    const std::string good = post(form(parts()), "Accept: image/x-portable-floatmap\r\n"), bad = post("--B--\r\n"),
                      expected = text_of(encode_image(library_mask(parts()), {"pfm", 32}));
    const int port = shared_port();
    std::vector<std::future<int>> clients;
    for (int client = 0; client < 8; ++client)
        clients.push_back(std::async(std::launch::async, [&, client] {
            int right = 0;
            for (int i = 0; i < 12; ++i) {
                const Reply reply = ask(port, (client + i) % 4 == 0 ? bad : good);
                right += (client + i) % 4 == 0 ? reply.status == 400 : reply.status == 200 && reply.body == expected;
            }
            return right;
        }));
    for (auto& client : clients) EXPECT_EQ(client.get(), 12);
}

TEST(Masks, MeshesComeAsPartsWhereTheyAreAllowed)
{
    nlohmann::json scene = scene_json();
    scene["occluders"] = {{"camera", scene["occluders"]["camera"]}, {"resolution", {side, side}}};
    scene["objects"] = {{{"mesh", "plate.obj"}}};
    const Parts all{{"scene", scene.dump()}, {"floor.exr", parts()[2].second}, {"plate.obj", "v -1 -1 -1\nv 1 -1 -1\nv 0 -1 1\nf 1 2 3\n"}};
    const Reply refused = ask(shared_port(), post(form(all)));
    EXPECT_EQ(refused.status, 422);
    EXPECT_TRUE(holds(refused.detail(), "objects[0].mesh")) << refused.detail();

    Running open{server::Options{.device = {}, .token = {}, .allow_meshes = true}};
    const Reply reply = ask(open.port, post(form(all)));
    EXPECT_EQ(reply.status, 200) << reply.body;
    Parts broken = all;
    broken[2].second = "not a mesh";
    const Reply wrong = ask(open.port, post(form(broken)));
    EXPECT_EQ(wrong.status, 422);
    EXPECT_FALSE(holds(wrong.body, "/tmp")) << wrong.body;
}

TEST(Masks, FilesThatAMeshNamesArePartsToo)
{
    nlohmann::json scene = scene_json();
    scene["occluders"] = {{"camera", scene["occluders"]["camera"]}, {"resolution", {side, side}}};
    scene["objects"] = {{{"mesh", "plate.gltf"}}};
    const nlohmann::json gltf = {{"asset", {{"version", "2.0"}}},
                                 {"nodes", {{{"mesh", 0}}}},
                                 {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}}}},
                                 {"accessors", {{{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}}}},
                                 {"bufferViews", {{{"buffer", 0}, {"byteLength", 36}}}},
                                 {"buffers", {{{"byteLength", 36}, {"uri", "plate%2Ebin"}}}}};
    const std::array<float, 9> corners{-1, -1, -1, 1, -1, -1, 0, -1, 1};
    Parts all{{"scene", scene.dump()}, {"floor.exr", parts()[2].second}, {"plate.gltf", gltf.dump()}};
    Running open{server::Options{.device = {}, .token = {}, .allow_meshes = true}};
    const Reply alone = ask(open.port, post(form(all)));
    EXPECT_EQ(alone.status, 422) << alone.body;
    EXPECT_TRUE(holds(alone.detail(), "objects[0].mesh")) << alone.detail();
    EXPECT_TRUE(holds(alone.detail(), "no part named \"plate.bin\"")) << alone.detail();
    all.push_back({"plate.bin", std::string(reinterpret_cast<const char*>(corners.data()), 36)});
    const Reply reply = ask(open.port, post(form(all)));
    EXPECT_EQ(reply.status, 200) << reply.body;
    all[2] = {"plate.obj", "v -1 -1 -1\nv 1 -1 -1\nv 0 -1 1\nf 1 2 3\n"};
    scene["objects"][0]["mesh"] = "plate.obj";
    all[0].second = scene.dump();
    EXPECT_TRUE(ask(open.port, post(form(all))).body == reply.body) << "the same triangle";
}

TEST(Negotiate, WeightsAndRanges)
{
    EXPECT_EQ(server::negotiate("", server::MaskImage::mask).format, "png");
    EXPECT_EQ(server::negotiate("*/*", server::MaskImage::mask).format, "png");
    EXPECT_EQ(server::negotiate("image/x-exr;q=0.9, image/tiff", server::MaskImage::mask).format, "tif");
    EXPECT_EQ(server::negotiate("IMAGE/PNG;q=0, image/*", server::MaskImage::mask).format, "exr");
    for (const char* none : {"text/html", "image/png;q=0", "image/png;q=x", "image/jpeg, application/*", ";,;"})
        EXPECT_THROW(server::negotiate(none, server::MaskImage::mask), std::exception) << none;
    for (const char* taken : {"", "*/*", "image/*", "image/x-exr", "image/png, image/x-exr;q=0.1"})
        EXPECT_EQ(server::negotiate(taken, server::MaskImage::bound).format, "exr") << taken;
    for (const char* none : {"image/png", "image/tiff, image/x-exr;q=0"})
        EXPECT_THROW(server::negotiate(none, server::MaskImage::bound), std::exception) << none;
}

} // namespace
} // namespace penumbra::test
