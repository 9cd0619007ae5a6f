// penumbra_bench_service FOLDER [SECONDS]: what bench/service.sh sends, and what the library makes of it by itself.
//
// Writes the bunny's scene into FOLDER, its depth as EXR and as PFM, each as a request's body, and the library's masks of it. Then prints
// masks a second of prepare and shade in this process, from one thread and from two, as CSV rows of bench/service.sh.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <penumbra/penumbra.hpp>

#include "io/image_io.hpp"
#include <penumbra/scene_file.hpp>
#include "rows.hpp"
#include "scenes.hpp"

namespace penumbra::bench {
namespace {

using Folder = std::filesystem::path;

// Two maps of 512 x 512, of which the technique reduces the occluders' to `resolution` x `resolution`.
Scene measured_scene(std::int64_t resolution)
{
    Scene scene = paper_scene(Occluder::bunny, {.light_side = 1, .occluder_resolution = 512, .receiver_resolution = 512});
    scene.technique = {"soft_shadow_map", {{"sides", std::string("front")}, {"resolution", resolution}}};
    scene = with_depth(scene, technique_from(scene.technique));
    scene.objects.clear(); // depth alone is sent
    return scene;
}

std::string text_of(const std::vector<std::byte>& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

void write(const Folder& file, const std::string& text) { write_file(file.string(), std::as_bytes(std::span(text))); }

std::string part(const std::string& name, const std::string& content)
{
    return "--penumbra-bench\r\nContent-Disposition: form-data; name=\"" + name + "\"\r\n\r\n" + content + "\r\n";
}

// FOLDER/NAME.json with its images of that kind (exr, pfm), and FOLDER/NAME.body.
void write_request(const Folder& folder, const Scene& scene, const std::string& name, const std::string& kind)
{
    const auto encoded = [&](const DepthMap& map) {
        return text_of(kind == "exr" ? encode_depth(map) : encode_image({map.width, map.height, 1, map.depth}, {"pfm", 32}));
    };
    const std::string front = "front." + kind, floor = "floor." + kind;
    DepthNames names;
    names.front = front;
    names.receiver = floor;
    const std::string json = write_scene(scene, names);
    const std::string front_bytes = encoded(*scene.occluders.front), floor_bytes = encoded(*scene.receivers.depth);
    write(folder / (name + ".json"), json);
    write(folder / front, front_bytes);
    write(folder / floor, floor_bytes);
    write(folder / (name + ".body"), part("scene", json) + part(front, front_bytes) + part(floor, floor_bytes) + "--penumbra-bench--\r\n");
}

// Prepares and shades from `threads` threads for `seconds`.
void print_rate(const Engine& engine, const Scene& scene, const char* name, int threads, double seconds)
{
    using Clock = std::chrono::steady_clock;
    const Technique technique = technique_from(scene.technique);
    const auto begin = Clock::now();
    const auto end = begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    std::vector<std::vector<double>> ms(static_cast<std::size_t>(threads));
    {
        std::vector<std::jthread> workers;
        for (auto& mine : ms)
            workers.emplace_back([&] {
                while (Clock::now() < end) {
                    const auto started = Clock::now();
                    engine.shade(engine.prepare(scene.light, scene.occluders, technique), scene.receivers);
                    mine.push_back(std::chrono::duration<double, std::milli>(Clock::now() - started).count());
                }
            });
    }
    const double taken = std::chrono::duration<double>(Clock::now() - begin).count();
    std::vector<double> all;
    for (const auto& mine : ms) all.insert(all.end(), mine.begin(), mine.end());
    const Timing timing = timing_of(all);
    std::printf("%s,%d,%.3f,%zu,%.1f,,,,%.3f,%.3f\n", name, threads, taken, all.size(), static_cast<double>(all.size()) / taken, timing.min,
                timing.median);
}

void run(const Folder& folder, double seconds)
{
    const Engine engine;
    print_engine(engine);
    const Scene made = measured_scene(128), heavy = measured_scene(512);
    for (const char* kind : {"exr", "pfm"}) write_request(folder, made, kind, kind);
    write_request(folder, heavy, "heavy", "exr");

    // What is measured is what can be read back.
    const Scene scene = load_scene((folder / "exr.json").string()), heavy_scene = load_scene((folder / "heavy.json").string());
    write_image((folder / "library.png").string(), engine.mask(scene).visibility, {"png", 16});
    write_image((folder / "library.pfm").string(), engine.mask(scene).visibility, {"pfm", 32});
    write_image((folder / "heavy.png").string(), engine.mask(heavy_scene).visibility, {"png", 16});
    for (const int threads : {1, 2}) {
        print_rate(engine, scene, "library", threads, seconds);
        print_rate(engine, heavy_scene, "library; 512 texels", threads, seconds);
    }
}

} // namespace
} // namespace penumbra::bench

int main(int argc, char** argv)
{
    if (argc < 2 || argc > 3) {
        std::fputs("usage: penumbra_bench_service FOLDER [SECONDS]\n", stderr);
        return 2;
    }
    try {
        penumbra::bench::run(argv[1], argc > 2 ? std::atof(argv[2]) : 3.0);
    } catch (const penumbra::Error& error) {
        std::fprintf(stderr, "penumbra_bench_service: %s\n", error.what());
        return penumbra::exit_code(error.code());
    }
    return 0;
}
