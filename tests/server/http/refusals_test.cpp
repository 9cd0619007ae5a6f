// What is refused, with which status, and that its detail names what was wrong.
#include "masks/multipart.hpp"
#include "process/problem.hpp"
#include "server/client.hpp"

namespace penumbra::test {
namespace {

void expect_problem(const Reply& reply, int status, const std::string& said, const std::string& what)
{
    EXPECT_EQ(reply.status, status) << what << "\n" << reply.head << reply.body;
    EXPECT_EQ(reply.header("Content-Type"), "application/problem+json") << what;
    EXPECT_TRUE(holds(reply.detail(), said)) << what << ": " << reply.body;
    EXPECT_EQ(reply.header("Connection"), "close") << what;
}

struct Case {
    std::string what, request;
    int status;
    std::string said;
};

std::string post_scene(const nlohmann::json& scene) { return post(form(parts(scene))); }
nlohmann::json changed(const std::string& pointer, const nlohmann::json& value)
{
    nlohmann::json scene = scene_json();
    scene[nlohmann::json::json_pointer(pointer)] = value;
    return scene;
}
Parts with(std::size_t index, const std::string& bytes)
{
    Parts all = parts();
    all[index].second = bytes;
    return all;
}

TEST(Refusals, OfTheRequest)
{
    const std::string body = form(parts());
    const std::vector<Case> cases{
        {"unknown path", "GET /secret HTTP/1.1\r\n\r\n", 404, "openapi.json"},
        {"path-like path", "GET /../etc/passwd HTTP/1.1\r\n\r\n", 404, "openapi.json"},
        {"wrong method", "GET /v1/masks HTTP/1.1\r\n\r\n", 405, "POST"},
        {"unknown POST route is not read", "POST /x HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n", 404, "openapi.json"},
        {"no length", head(""), 411, "Content-Length"},
        {"chunked", head("Transfer-Encoding: chunked\r\n") + "5\r\nhello\r\n0\r\n\r\n", 411, "Transfer-Encoding"},
        {"chunked and length", head("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n") + "0\r\n\r\n", 411, "Transfer-Encoding"},
        {"two lengths", head("Content-Length: 5\r\nContent-Length: 6\r\n") + "hello", 400, "Content-Length"},
        {"negative length", head("Content-Length: -5\r\n"), 400, "Content-Length"},
        {"length with text", head("Content-Length: 5x\r\n"), 400, "Content-Length"},
        {"too long", head("Content-Length: 67108865\r\n"), 413, "67108864"},
        {"gzip", post(body, "Content-Encoding: gzip\r\n"), 415, "Content-Encoding"},
        {"no form", head(length_of(body), "application/json") + body, 415, "multipart/form-data"},
        {"no boundary", head(length_of(body), "multipart/form-data") + body, 400, "boundary"},
        {"accept", post(body, "Accept: text/html\r\n"), 406, "image/x-exr"},
        {"large headers",
         head("X-Large: " + std::string(5000, 'x') + "\r\nX-2: " + std::string(5000, 'x') + "\r\nX-3: " + std::string(8000, 'x') + "\r\n"),
         431, "16384"},
        {"expect", head("Content-Length: 67108865\r\nExpect: 100-continue\r\n"), 413, "67108864"},
    };
    for (const Case& c : cases) expect_problem(ask(shared_port(), c.request), c.status, c.said, c.what);
}

TEST(Refusals, OfTheParts)
{
    Parts twice = parts(), many = parts();
    twice.push_back(twice.back());
    for (int i = 0; i < 14; ++i) many.emplace_back("more" + std::to_string(i), "x");
    const std::string body = form(parts()), exr = parts()[1].second;
    std::vector<Case> cases{
        {"no scene", post(form({{"front.exr", "x"}})), 400, "scene"},
        {"no parts", post("--B--\r\n"), 400, "scene"},
        {"empty body", post(""), 400, "boundary"},
        {"duplicate part", post(form(twice)), 400, "floor.exr"},
        {"too many parts", post(form(many)), 413, "16"},
        {"no last boundary", post(body.substr(0, body.size() - 8)), 400, "truncated"},
        {"large scene", post(form(with(0, std::string((1 << 20) + 1, ' ')))), 413, "1048576"},
        {"no JSON", post(form(with(0, "{"))), 422, "JSON"},
        {"unknown key", post_scene(changed("/lihgt", 1)), 422, "lihgt"},
        {"unknown setting", post_scene(changed("/technique/bais", 1)), 422, "bais"},
        {"unknown technique", post_scene(changed("/technique/kind", "auto")), 422, "technique.kind"},
        {"no such part", post_scene(changed("/receivers/depth", "other.exr")), 422, "receivers.depth"},
        {"a path", post_scene(changed("/receivers/depth", "/etc/passwd")), 422, "no part named"},
        {"the scene as image", post_scene(changed("/receivers/depth", "scene")), 422, "no part named"},
        {"no image", post(form(with(1, "GIF89a"))), 422, "EXR, PNG, TIFF or PFM"},
        {"an HDR image", post(form(with(1, "#?RADIANCE\n"))), 422, "EXR, PNG, TIFF or PFM"},
        {"empty image", post(form(with(1, ""))), 422, "EXR, PNG, TIFF or PFM"},
        {"truncated EXR", post(form(with(1, exr.substr(0, exr.size() / 2)))), 422, "occluders.depth.front"},
        {"truncated PFM", post(form(with(1, "Pf\n32 32\n-1\nxx"))), 422, "occluders.depth.front"},
        {"lying PFM", post(form(with(1, "Pf\n60000 60000\n-1\nxx"))), 413, "16777216"},
        {"many images", post_scene(changed("/occluders/depth/layers", std::vector<std::string>(17, "front.exr"))), 413, "16"},
        {"large mask",
         post_scene({{"penumbra", 1},
                     {"light", scene_json()["light"]},
                     {"receivers", {{"resolution", {4096, 4096}}}},
                     {"objects", {{{"quad", {{"center", {0, -1, 0}}, {"half_u", {1, 0, 0}}, {"half_v", {0, 0, -1}}}}}}}}),
         413, "4194304"},
    };
    for (const char* name : {"../x", "/etc/passwd", "a/b", "", ".hidden", "a\\\\b", "x y"}) {
        Parts all = parts();
        all[1].first = name;
        cases.push_back({"part named " + all[1].first, post(form(all)), 400, "name"});
    }
    for (const Case& c : cases) expect_problem(ask(shared_port(), c.request), c.status, c.said, c.what);
}

TEST(Refusals, OfWorkThatIsTooMuch)
{
    Running small{server::Options{.device = {}, .token = {}, .receivers = 1023}};
    expect_problem(ask(small.port, post(form(parts()))), 413, "1023", "receivers");
    Running few{server::Options{.device = {}, .token = {}, .pairs = 1000}};
    expect_problem(ask(few.port, post(form(parts()))), 413, "receivers.resolution", "pairs");
    // Four edges of 16 parts, each met by some of 1024 receivers.
    nlohmann::json split = scene_json();
    split["technique"] = {{"kind", "soft_shadow_volume"}, {"light_splits", 4}};
    expect_problem(ask(few.port, post(form(parts(split)))), 413, "technique.light_splits", "pairs");
    // One slice that holds something, looked up by 1024 receivers.
    nlohmann::json slices = scene_json();
    slices["technique"] = {{"kind", "occlusion_texture"}, {"slices", 4}, {"resolution", 16}};
    expect_problem(ask(few.port, post(form(parts(slices)))), 413, "technique.slices", "pairs");
    // 64 slices of each of 256 parts: 2^14 textures, 2^30 texels at 256 x 256.
    slices["technique"] = {{"kind", "occlusion_texture"}, {"slices", 64}, {"light_splits", 16}};
    expect_problem(ask(shared_port(), post(form(parts(slices)))), 413, "technique.resolution", "texels of slices");
    nlohmann::json rays = scene_json();
    rays["technique"] = {{"kind", "ray_traced"}, {"samples", 65536}};
    Running dim{server::Options{.device = {}, .token = {}, .rays = side * side}};
    expect_problem(ask(dim.port, post_scene(rays)), 413, "technique.samples", "rays");
}

TEST(Refusals, BodiesThatEndOrStop)
{
    const std::string body = form(parts());
    {
        Socket socket(shared_port());
        socket.send(post(body).substr(0, 400));
        socket.end();
        expect_problem(Reply(socket.receive()), 400, "ended after", "truncated");
    }
    Running impatient{server::Options{.device = {}, .token = {}, .deadline_s = 1}};
    Socket socket(impatient.port);
    socket.send(post(body).substr(0, 400)); // and then nothing: the deadline answers
    expect_problem(Reply(socket.receive()), 408, "within 1 s", "stopped");
}

TEST(Refusals, AClientThatEndsItsSideStillGetsItsMask)
{
    Socket socket(shared_port());
    socket.send(post(form(parts())));
    socket.end();
    EXPECT_EQ(Reply(socket.receive()).status, 200);
}

TEST(Refusals, TheAnswerToARefusedUploadArrives)
{
    // 3 MB that nobody wants: the client sends them all before it listens.
    const std::string body(3'000'000, 'x');
    expect_problem(ask(shared_port(), post(body, "Content-Encoding: br\r\n")), 415, "identity", "refused upload");
}

TEST(Refusals, ABodyIsNeverTheNextRequest)
{
    const std::string hidden = "GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
    const Reply reply =
        ask(shared_port(), "GET /healthz HTTP/1.1\r\nContent-Length: " + std::to_string(hidden.size()) + "\r\n\r\n" + hidden);
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.body, "alive\n");
}

TEST(Refusals, Token)
{
    Running closed{server::Options{.device = {}, .token = "0123456789abcdef"}};
    for (const char* wrong :
         {"", "Authorization: Bearer \r\n", "Authorization: Bearer 0123456789abcdeF\r\n", "Authorization: Bearer 0123456789abcdef0\r\n",
          "Authorization: Bearer 0123456789abcde\r\n", "Authorization: Basic 0123456789abcdef\r\n"}) {
        expect_problem(get(closed.port, "/metrics", wrong), 401, "Bearer", wrong);
        expect_problem(ask(closed.port, post(form(parts()), wrong)), 401, "Bearer", wrong);
    }
    EXPECT_EQ(get(closed.port, "/metrics", "Authorization: Bearer 0123456789abcdef\r\n").status, 200);
    EXPECT_EQ(get(closed.port, "/healthz").status, 200);
    EXPECT_EQ(get(closed.port, "/readyz").status, 200);
}

// --- The reader of forms ---------------------------------------------------------------------------------------------------------------

TEST(Multipart, EveryPrefixIsRefused)
{
    const std::string body = form({{"scene", "{}"}, {"a", ""}, {"b", "\r\n--\r\n-B"}});
    const auto whole = server::parse_multipart(body, "B", 3);
    ASSERT_EQ(whole.size(), 3u);
    EXPECT_EQ(whole[0].bytes, "{}");
    EXPECT_EQ(whole[1].bytes, "");
    for (std::size_t size = 0; size + 2 < body.size(); ++size)
        EXPECT_THROW(server::parse_multipart(std::string_view(body).substr(0, size), "B", 3), server::Problem) << size;
}

TEST(Multipart, HeaderLinesHaveALimit)
{
    const std::string body = "--B\r\nX: " + std::string(std::size_t{32} << 20, 'x');
    EXPECT_THROW(server::parse_multipart(body, "B", 3), server::Problem);
}

TEST(Multipart, Boundaries)
{
    EXPECT_EQ(server::boundary_of("multipart/form-data; boundary=abc"), "abc");
    EXPECT_EQ(server::boundary_of("Multipart/Form-Data;charset=utf-8; Boundary=\"a:b\""), "a:b");
    for (const std::string& bad :
         {std::string("multipart/form-data"), std::string("multipart/form-data; boundary="),
          std::string("multipart/form-data; boundary=a b"), std::string("multipart/form-data; boundary=a; boundary=b"),
          "multipart/form-data; boundary=" + std::string(71, 'x'), std::string("multipart/form-data; boundary=\"a"),
          std::string("text/plain; boundary=a"), std::string()})
        EXPECT_THROW(server::boundary_of(bad), server::Problem) << bad;
}

} // namespace
} // namespace penumbra::test
