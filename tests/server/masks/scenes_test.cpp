// Kept scenes: the same masks without sending the scene again, for a while and within a budget; entity tags.
#include <algorithm>
#include <chrono>
#include <future>
#include <span>

#include "io/image_io.hpp"
#include "masks/digest.hpp"
#include "masks/scene_store.hpp"
#include "process/problem.hpp"
#include "server/client.hpp"

namespace penumbra::test {
namespace {

using Json = nlohmann::json;

std::string to_path(const std::string& path, const std::string& request)
{
    return "POST " + path + request.substr(request.find(" HTTP/1.1"));
}

Reply keep(int port, const Parts& all = parts()) { return ask(port, to_path("/v1/scenes", post(form(all)))); }
std::string id_in(const Reply& reply) { return Json::parse(reply.body).at("id"); }

Reply mask_of(int port, const std::string& id, const std::string& patch, const std::string& headers = {})
{
    return ask(port, "POST /v1/scenes/" + id + "/masks HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nAccept: " +
                         "image/x-portable-floatmap\r\n" + length_of(patch) + headers + "\r\n" + patch);
}

// The same mask as POST /v1/masks gives for the whole scene.
std::string fresh_mask(int port, const Parts& all)
{
    const Reply reply = ask(port, post(form(all), "Accept: image/x-portable-floatmap\r\n"));
    EXPECT_EQ(reply.status, 200) << reply.body;
    return reply.body;
}

// A scene of objects alone: a quad over a floor, seen by a camera of its own.
Json objects_scene()
{
    const auto quad = [](double y, double half) {
        return Json{{"center", {0, y, 0}}, {"half_u", {half, 0, 0}}, {"half_v", {0, 0, -half}}};
    };
    return {{"penumbra", 1},
            {"light", {{"kind", "rectangle"}, {"center", {0, 6, 0}}, {"half_u", {0.5, 0, 0}}, {"half_v", {0, 0, -0.5}}}},
            {"objects", {{{"quad", quad(2, 0.5)}, {"receives", false}}, {{"quad", quad(0, 4)}, {"casts", false}}}},
            {"occluders", {{"resolution", {32, 32}}}},
            {"receivers",
             {{"camera", {{"kind", "pinhole"}, {"eye", {0, 8, 0}}, {"target", {0, 0, 0}}, {"up", {0, 0, -1}}, {"vertical_fov_deg", 50}}},
              {"resolution", {24, 24}}}}};
}

TEST(Scenes, GiveTheMaskOfTheWholeScene)
{
    const int port = shared_port();
    const Reply kept = keep(port);
    ASSERT_EQ(kept.status, 201) << kept.body;
    const std::string id = id_in(kept);
    EXPECT_EQ(kept.header("Location"), "/v1/scenes/" + id);
    EXPECT_EQ(keep(port).status, 200) << "kept already";
    EXPECT_EQ(id_in(keep(port)), id);

    const std::string expected = fresh_mask(port, parts());
    EXPECT_EQ(mask_of(port, id, "").body, expected);
    EXPECT_EQ(mask_of(port, id, "{}").body, expected);

    // A smaller light, and another technique.
    Json scene = scene_json();
    scene["light"]["half_u"] = {0.125, 0, 0};
    EXPECT_EQ(mask_of(port, id, R"({"light": {"half_u": [0.125, 0, 0]}})").body, fresh_mask(port, parts(scene)));
    scene = scene_json();
    scene["technique"] = {{"kind", "shadow_map"}};
    EXPECT_EQ(mask_of(port, id, R"({"technique": {"kind": "shadow_map"}})").body, fresh_mask(port, parts(scene)));
    EXPECT_EQ(mask_of(port, id, "{}").body, expected) << "a patch changes nothing that is kept";
}

TEST(Scenes, SkipUploadDecodeAndPrepare)
{
    const int port = shared_port();
    const std::string id = id_in(keep(port));
    const Reply again = mask_of(port, id, "{}");
    ASSERT_EQ(again.status, 200);
    EXPECT_EQ(again.header("Server-Timing").find("prepare;"), std::string::npos) << again.header("Server-Timing");
    EXPECT_NE(again.header("Server-Timing").find("shade;"), std::string::npos);
    const Reply other = mask_of(port, id, R"({"light": {"half_u": [0.0625, 0, 0]}})");
    EXPECT_NE(other.header("Server-Timing").find("prepare;"), std::string::npos) << "another light is prepared";
}

TEST(Scenes, FollowALightOverObjects)
{
    const int port = shared_port();
    const Json scene = objects_scene();
    const std::string id = id_in(keep(port, {{"scene", scene.dump()}}));
    const std::string before = mask_of(port, id, "{}").body;
    EXPECT_EQ(before, fresh_mask(port, {{"scene", scene.dump()}}));

    const Reply moved = mask_of(port, id, R"({"light": {"center": [1, 6, 0.5]}})");
    ASSERT_EQ(moved.status, 200) << moved.body;
    EXPECT_NE(moved.body, before);
    // Against the scene sent whole: the rays' hierarchy lies around the first light's centre instead, which moves an edge by float32
    // rounding of coordinates below 16: far below 2^-10 of the light's width of 1.
    Json whole = scene;
    whole["light"]["center"] = {1, 6, 0.5};
    const auto pixels = [](const std::string& file) { return decode_image(std::as_bytes(std::span(file)), "mask").pixels; };
    const std::vector<float> a = pixels(moved.body), b = pixels(fresh_mask(port, {{"scene", whole.dump()}}));
    ASSERT_EQ(a.size(), b.size());
    float worst = 0;
    for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
    EXPECT_LT(worst, 0x1p-10F);
    // The camera is not the light's: its depth was rendered once.
    EXPECT_EQ(mask_of(port, id, "{}").body, before);

    // A directional light's view reads differently; so does the technique that traces rays.
    const std::string rays = R"("technique": {"kind": "ray_traced", "samples": 4})";
    EXPECT_EQ(
        mask_of(port, id, R"({"light": {"kind": "directional", "direction": [0, -1, 0], "angular_diameter_deg": 2}, )" + rays + "}").status,
        200);
    EXPECT_EQ(mask_of(port, id, "{" + rays + "}").status, 200);
}

// Maps that were sent are the light's view, and move with it.
TEST(Scenes, SayThatSentMapsMoveWithTheirLight)
{
    const int port = shared_port();
    const std::string id = id_in(keep(port));
    const Reply before = mask_of(port, id, "{}"), moved = mask_of(port, id, R"({"light": {"center": [1, 0, 0.5]}})");
    ASSERT_EQ(moved.status, 200) << moved.body;
    EXPECT_EQ(moved.body, before.body);
    EXPECT_TRUE(holds(moved.header("Penumbra-Warnings"), "occluders.depth and receivers.depth were sent as the light's own view and moved with the light")) << moved.head;
    EXPECT_TRUE(holds(moved.header("Penumbra-Warnings"), "send objects")) << moved.head;
    EXPECT_EQ(before.header("Penumbra-Warnings").find("moved with"), std::string::npos) << before.head;
    // Another size leaves it where it is; turned it looks elsewhere.
    EXPECT_EQ(mask_of(port, id, R"({"light": {"half_u": [0.125, 0, 0]}})").header("Penumbra-Warnings").find("moved with"), std::string::npos);
    EXPECT_TRUE(holds(mask_of(port, id, R"({"light": {"half_v": [0, 0, 0.25]}})").header("Penumbra-Warnings"), "moved with the light"));

    // Over objects the light moves alone.
    const std::string objects = id_in(keep(port, {{"scene", objects_scene().dump()}}));
    EXPECT_EQ(mask_of(port, objects, R"({"light": {"center": [1, 6, 0.5]}})").header("Penumbra-Warnings").find("moved with"), std::string::npos);

    // With receivers of a camera of their own the casters alone move.
    Json seen = scene_json();
    seen["receivers"]["camera"] = {{"kind", "pinhole"}, {"eye", {0, 2, 0}}, {"target", {0, -2, 0}}, {"up", {0, 0, -1}}, {"vertical_fov_deg", 50}};
    const Reply half = mask_of(port, id_in(keep(port, parts(seen))), R"({"light": {"center": [0.25, 0, 0]}})");
    ASSERT_EQ(half.status, 200) << half.body;
    EXPECT_TRUE(holds(half.header("Penumbra-Warnings"), "occluders.depth was sent as the light's own view")) << half.head;
}

TEST(Scenes, TakeFurtherImagesWithAPatch)
{
    const int port = shared_port();
    const std::string id = id_in(keep(port));
    const std::string nearer = text_of(encode_depth(flat(side, side, 1.5)));
    const std::string path = "/v1/scenes/" + id + "/masks", accept = "Accept: image/x-portable-floatmap\r\n";

    // Under the kept name, and under a name of its own: the same mask as from the whole scene.
    Parts whole = parts();
    whole[2].second = nearer;
    const std::string expected = fresh_mask(port, whole);
    const Reply replaced = ask(port, to_path(path, post(form({{"floor.exr", nearer}}), accept)));
    EXPECT_EQ(replaced.body, expected);
    const Reply added =
        ask(port, to_path(path, post(form({{"scene", R"({"receivers": {"depth": "near.exr"}})"}, {"near.exr", nearer}}), accept)));
    EXPECT_EQ(added.body, expected);
    EXPECT_EQ(mask_of(port, id, "{}").body, fresh_mask(port, parts())) << "for that request only";

    // New occluders for this request.
    whole = parts();
    whole[1].second = text_of(encode_depth(flat(side, side, 1)));
    EXPECT_EQ(ask(port, to_path(path, post(form({{"front.exr", whole[1].second}}), accept))).body, fresh_mask(port, whole));
    EXPECT_EQ(mask_of(port, id, "{}").body, fresh_mask(port, parts()));
}

TEST(Scenes, RefuseWhatCannotBe)
{
    const int port = shared_port();
    const std::string id = id_in(keep(port)), nobody(64, 'a');
    EXPECT_EQ(mask_of(port, nobody, "{}").status, 404);
    EXPECT_EQ(Json::parse(mask_of(port, nobody, "{}").body)["reason"], "no_scene");
    EXPECT_EQ(get(port, "/v1/scenes/" + nobody).status, 404);
    EXPECT_EQ(get(port, "/v1/scenes/short").status, 404);
    EXPECT_EQ(get(port, "/v1/scenes/" + id + "x").status, 404);
    EXPECT_EQ(get(port, "/v1/scenes").status, 405);

    EXPECT_EQ(mask_of(port, id, R"({"objects": []})").status, 422);
    EXPECT_NE(mask_of(port, id, R"({"objects": []})").detail().find("objects: cannot be changed"), std::string::npos);
    EXPECT_EQ(mask_of(port, id, "[]").status, 422);
    EXPECT_EQ(mask_of(port, id, "{").status, 422);
    EXPECT_EQ(mask_of(port, id, R"({"light": {"center": "here"}})").status, 422);
    EXPECT_NE(mask_of(port, id, R"({"light": {"center": "here"}})").detail().find("light.center"), std::string::npos);
    EXPECT_EQ(mask_of(port, id, R"({"light": null})").status, 422);
    EXPECT_EQ(mask_of(port, id, R"({"receivers": {"depth": "no.exr"}})").status, 422);
    EXPECT_EQ(mask_of(port, id, R"({"technique": {"kind": "soft_shadow_map", "sidse": 1}})").status, 422);
    EXPECT_EQ(mask_of(port, id, "{}").status, 200);

    // A scene that is wrong is not kept.
    Json wrong = scene_json();
    wrong["technique"]["sides"] = "back"; // which it has no image of
    const Reply refused = keep(port, parts(wrong));
    EXPECT_EQ(refused.status, 422) << refused.body;
    EXPECT_EQ(keep(port, {{"scene", "{"}}).status, 422);
    EXPECT_EQ(keep(port, {{"front.exr", "x"}}).status, 400);
}

TEST(Scenes, KeepObjectsWhereTheyAre)
{
    const int port = shared_port();
    Json scene = objects_scene();
    scene["objects"].push_back({{"depth", "view.exr"}, {"camera", {{"kind", "light"}, {"tan_half_fov", {1, 1}}}}});
    const std::string view = text_of(encode_depth(flat(16, 16, 7)));
    const Reply kept = keep(port, {{"scene", scene.dump()}, {"view.exr", view}});
    ASSERT_EQ(kept.status, 201) << kept.body;
    const Reply moved = mask_of(port, id_in(kept), R"({"light": {"center": [1, 6, 0]}})");
    EXPECT_EQ(moved.status, 422) << "the object would have to move with the light";
    EXPECT_NE(moved.detail().find("light"), std::string::npos);
    EXPECT_EQ(mask_of(port, id_in(kept), R"({"technique": {"kind": "shadow_map"}})").status, 200);
    const Reply replaced = ask(port, to_path("/v1/scenes/" + id_in(kept) + "/masks", post(form({{"view.exr", view}}))));
    EXPECT_EQ(replaced.status, 422) << replaced.body;
}

TEST(Scenes, CanBeAskedAboutAndLetGo)
{
    Running own{server::Options{}};
    const std::string id = id_in(keep(own.port));
    const Json about = Json::parse(get(own.port, "/v1/scenes/" + id).body);
    EXPECT_EQ(about["id"], id);
    EXPECT_GT(about["bytes"].get<int>(), 2 * side * side * 4);
    EXPECT_LE(about["expires_s"].get<int>(), 600);
    EXPECT_GT(about["expires_s"].get<int>(), 590 - 60);
    wait_for_metric(own.port, "penumbra_kept_scenes 1");
    const std::string gone = "DELETE /v1/scenes/" + id + " HTTP/1.1\r\nHost: localhost\r\n\r\n";
    EXPECT_EQ(ask(own.port, gone).status, 204);
    EXPECT_EQ(ask(own.port, gone).status, 404);
    EXPECT_EQ(mask_of(own.port, id, "{}").status, 404);
    wait_for_metric(own.port, "penumbra_kept_scenes 0");
    wait_for_metric(own.port, "penumbra_kept_scene_bytes 0");
}

TEST(Scenes, HaveABudget)
{
    Running tight{server::Options{.device = {}, .token = {}, .slots = 1, .spares = 0, .scenes_bytes = 1000}};
    const Reply refused = keep(tight.port);
    EXPECT_EQ(refused.status, 413);
    EXPECT_NE(refused.detail().find("1000"), std::string::npos) << refused.body;
    Running none{server::Options{.device = {}, .token = {}, .scenes = 0}};
    EXPECT_EQ(keep(none.port).status, 403);
}

TEST(Scenes, ManyClientsOfOneScene)
{
    const int port = shared_port();
    const std::string id = id_in(keep(port, {{"scene", objects_scene().dump()}}));
    const auto patch = [](int i) { return R"({"light": {"center": [)" + std::to_string(i % 7) + R"(e-1, 6, 0]}})"; };
    std::vector<std::string> expected;
    for (int i = 0; i < 7; ++i) expected.push_back(mask_of(port, id, patch(i)).body);
    std::vector<std::future<std::string>> replies;
    for (int i = 0; i < 14; ++i) replies.push_back(std::async(std::launch::async, [&, i] { return mask_of(port, id, patch(i)).body; }));
    for (int i = 0; i < 14; ++i) EXPECT_EQ(replies[static_cast<std::size_t>(i)].get(), expected[static_cast<std::size_t>(i % 7)]) << i;
}

// --- The store alone, with a clock of its own ------------------------------------------------------------------------------------------

struct Kept {
    explicit Kept(int number)
    {
        Json scene = scene_json();
        scene["light"]["center"] = {number, 0, 0};
        all = parts(scene);
        std::vector<server::Part> views;
        for (const auto& [name, bytes] : all) views.push_back({name, bytes});
        scene_ = std::make_shared<server::KeptScene>(server::id_of(views), views, options, server::Deadline(std::chrono::seconds(60)));
    }
    Parts all;
    server::Options options;
    std::shared_ptr<server::KeptScene> scene_;
};

TEST(SceneStore, LetsTheLongestUnusedGo)
{
    auto now = server::SceneStore::Clock::now();
    const Kept a(1), b(2), c(3);
    const std::uint64_t each = a.scene_->bytes();
    server::SceneStore store(2 * each + each / 2, 10, std::chrono::seconds(100), [&] { return now; });
    store.keep(a.scene_);
    store.keep(b.scene_);
    EXPECT_TRUE(store.find(a.scene_->id(), true));
    store.keep(c.scene_);
    EXPECT_FALSE(store.find(b.scene_->id(), false)) << "a was used after b";
    EXPECT_TRUE(store.find(a.scene_->id(), false));
    EXPECT_EQ(store.counts().scenes, 2u);
    EXPECT_LE(store.counts().bytes, 2 * each + each / 2);

    server::SceneStore few(1000 * each, 2, std::chrono::seconds(100), [&] { return now; });
    for (const Kept* kept : {&a, &b, &c}) few.keep(kept->scene_);
    EXPECT_EQ(few.counts().scenes, 2u);
}

TEST(SceneStore, ForgetsAfterAWhileWithoutUse)
{
    auto now = server::SceneStore::Clock::now();
    const Kept a(1), b(2);
    server::SceneStore store(1 << 30, 10, std::chrono::seconds(100), [&] { return now; });
    store.keep(a.scene_);
    store.keep(b.scene_);
    now += std::chrono::seconds(99);
    EXPECT_TRUE(store.find(a.scene_->id(), true));
    EXPECT_TRUE(store.find(b.scene_->id(), false)) << "being asked about is no use";
    EXPECT_EQ(store.seconds_left(b.scene_->id()), 1);
    now += std::chrono::seconds(1);
    EXPECT_TRUE(store.find(a.scene_->id(), false));
    EXPECT_FALSE(store.find(b.scene_->id(), false));
}

TEST(ScenePatch, MergesAsTheRfcSaysButForAnotherKind)
{
    const SceneDocument scene(R"({"light": {"kind": "point", "center": [0, 1, 0]}, "technique": {"kind": "a", "x": 1}})");
    const auto patched = [&](const char* patch, const char* section) { return scene.patched(patch).text(section); };
    EXPECT_EQ(scene.patched("{}").text(), scene.text());
    EXPECT_EQ(scene.patched("").text(), scene.text());
    EXPECT_EQ(Json::parse(patched(R"({"light": {"center": [1, 1, 1]}})", "light")), (Json{{"kind", "point"}, {"center", {1, 1, 1}}}));
    EXPECT_EQ(Json::parse(patched(R"({"technique": {"kind": "b", "y": 2}})", "technique")), (Json{{"kind", "b"}, {"y", 2}}));
    EXPECT_EQ(Json::parse(patched(R"({"technique": {"kind": "a", "y": 2}})", "technique")), (Json{{"kind", "a"}, {"x", 1}, {"y", 2}}));
    EXPECT_FALSE(scene.patched(R"({"technique": null})").has("technique"));
    EXPECT_EQ(Json::parse(patched(R"({"technique": {"x": null}})", "technique")), (Json{{"kind", "a"}}));
    EXPECT_THROW(scene.patched(R"({"penumbra": 2})"), Error);
}

// --- Entity tags -------------------------------------------------------------------------------------------------------------------------

TEST(EntityTags, OfMasks)
{
    const int port = shared_port();
    const std::string request = post(form(parts()));
    const std::string tag = ask(port, request).header("ETag");
    ASSERT_TRUE(tag.starts_with("\"sha256-")) << tag;
    EXPECT_EQ(ask(port, request).header("ETag"), tag);
    const Reply had = ask(port, post(form(parts()), "If-None-Match: \"other\", " + tag + "\r\n"));
    EXPECT_EQ(had.status, 304);
    EXPECT_EQ(had.body, "");
    EXPECT_EQ(had.header("ETag"), tag);
    EXPECT_EQ(ask(port, post(form(parts()), "If-None-Match: \"other\"\r\n")).status, 200);
    EXPECT_NE(ask(port, post(form(parts()), "Accept: image/x-exr\r\n")).header("ETag"), tag) << "another format";
    Json scene = scene_json();
    scene["light"]["half_u"] = {0.125, 0, 0};
    EXPECT_NE(ask(port, post(form(parts(scene)))).header("ETag"), tag) << "another light";
}

TEST(EntityTags, OfKeptScenesAndDocuments)
{
    const int port = shared_port();
    const std::string id = id_in(keep(port));
    const std::string patch = R"({"light": {"half_u": [0.125, 0, 0]}})", tag = mask_of(port, id, patch).header("ETag");
    EXPECT_EQ(mask_of(port, id, patch, "If-None-Match: " + tag + "\r\n").status, 304);
    EXPECT_EQ(mask_of(port, id, "{}", "If-None-Match: " + tag + "\r\n").status, 200);
    for (const char* path : {"/", "/openapi.json", "/v1/techniques", "/v1/devices"}) {
        const Reply whole = get(port, path);
        ASSERT_EQ(whole.status, 200) << path;
        const Reply had = get(port, path, "If-None-Match: " + whole.header("ETag") + "\r\n");
        EXPECT_EQ(had.status, 304) << path;
        EXPECT_EQ(had.body, "") << path;
    }
}

TEST(Digests, AreSha256)
{
    // FIPS 180-2's "abc" is what SHA-256 of it alone gives; ours puts each piece's length before it, so that pieces cannot run together.
    EXPECT_EQ(server::Digest().add("abc").hex().size(), 64u);
    EXPECT_NE(server::Digest().add("ab").add("c").hex(), server::Digest().add("a").add("bc").hex());
    EXPECT_EQ(server::Digest().add("ab").add("c").hex(), server::Digest().add("ab").add("c").hex());
    // sha256 of eight bytes 3, 0, 0, ... and "abc", by another program: printf '\3\0\0\0\0\0\0\0abc' | sha256sum
    EXPECT_EQ(server::Digest().add("abc").hex(), "ce91dc5eec0139adf091900d225971d6ad246a845bad791b5693a9d0d55dd391");
}

} // namespace
} // namespace penumbra::test
