// Work that another thread ends: at once, wherever it is, and whatever else runs goes on.
#include <chrono>
#include <ctime>
#include <future>
#include <thread>

#include <penumbra/mask_job.hpp>
#include <penumbra/stop.hpp>

#include "scene/parallel.hpp"
#include "scene/stop.hpp"
#include "support/casters.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

// Every receiver sees all texels: 2^14 receivers times 2^20 texels, minutes.
Scene endless()
{
    Scene scene;
    scene.light = rectangle_light(8, 8);
    scene.receivers = {.camera = light_view(0.1), .width = 512, .height = 512, .depth = flat(512, 512, 2)};
    scene.occluders = occluders(light_view(), map_of(1024, 1024, [](int x, int y) { return (x + y) % 2 == 0 ? 1.0F : nothing_there; }));
    return scene;
}

TEST(Stop, EndsAKernelThatRuns)
{
    const Engine engine;
    const Scene scene = endless();
    const SoftShadowMap technique{.sides = Sides::front, .tolerance = 0};
    // Without waiting for the kernel to be built.
    Scene warm = scene;
    warm.receivers = {.camera = light_view(0.1), .width = 8, .height = 8, .depth = flat(8, 8, 0.5)};
    engine.mask(warm, technique);

    Stop stop;
    std::promise<void> shading;
    std::clock_t asked = 0; // of the processor: what other programs take of it says nothing
    std::jthread other([&] {
        shading.get_future().wait();
        std::this_thread::sleep_for(std::chrono::milliseconds(300)); // well within the kernel
        asked = std::clock();
        stop.ask();
    });
    const StopScope scope(stop);
    const MaskHooks hooks{.keeper = nullptr, .before = [&](std::string_view next) { if (next == "shading") shading.set_value(); }, .estimated = {}};
    EXPECT_THROW(engine.masks(job_of(scene, technique), hooks, [](NamedMask&&) { FAIL() << "a mask that is not whole"; }), Stopped);
    EXPECT_LT(static_cast<double>(std::clock() - asked) / CLOCKS_PER_SEC, 0.5 * thread_count());
}

TEST(Stop, IsSeenBeforeTheFirstLaunch)
{
    Stop stop;
    stop.ask();
    const StopScope scope(stop);
    const Engine engine;
    EXPECT_THROW(engine.mask(endless(), SoftShadowMap{.sides = Sides::front}), Stopped);
    EXPECT_THROW(parallel_for(4, [](int) { FAIL(); }), Stopped);
}

TEST(Stop, CountsForItsScopeAndThreadAlone)
{
    Stop stop;
    stop.ask();
    {
        const StopScope scope(stop);
        EXPECT_THROW(check_stop(), Stopped);
        const Stop inner;
        const StopScope within(inner);
        EXPECT_NO_THROW(check_stop());
        std::jthread([] { EXPECT_NO_THROW(check_stop()); });
    }
    EXPECT_NO_THROW(check_stop());
}

// Threads of a loop look at the stop of who began it.
TEST(Stop, EndsALoopOfManyThreads)
{
    Stop stop;
    const StopScope scope(stop);
    std::atomic<int> begun = 0;
    EXPECT_THROW(parallel_for(100000,
                              [&](int) {
                                  if (++begun == 10) stop.ask();
                              }),
                 Stopped);
    EXPECT_LT(begun, 10 + static_cast<int>(thread_count()));
}

} // namespace
} // namespace penumbra::test
