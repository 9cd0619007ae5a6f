#include "process/room.hpp"

#include <gtest/gtest.h>

#include "process/memory.hpp"

namespace penumbra::test {
namespace {

TEST(Room, GivesWhatThereIsAndTakesItBack)
{
    server::Room room(100);
    auto first = room.take(60);
    ASSERT_TRUE(first);
    EXPECT_FALSE(room.take(41));
    {
        const auto second = room.take(40);
        ASSERT_TRUE(second);
        EXPECT_EQ(room.taken(), 100U);
        EXPECT_FALSE(room.take(1));
    }
    EXPECT_EQ(room.taken(), 60U);
    const server::Room::Hold moved = std::move(*first);
    first.reset();
    EXPECT_EQ(room.taken(), 60U) << "it went along";
}

TEST(Room, SharesAddUpToTheLimit)
{
    for (const std::int64_t mib : {256, 1500, 2000, 8000}) {
        server::Options options;
        options.memory = mib << 20;
        options.slots = 3;
        options.spares = 2;
        const std::uint64_t workers = 3 + server::spare_workers(options);
        const std::uint64_t limit = server::memory_limit(options);
        EXPECT_LE(workers * server::worker_memory(options) + server::uploads_memory(options) + server::answers_memory(options), limit);
        EXPECT_GT(server::uploads_memory(options), limit / 16);
    }
}

} // namespace
} // namespace penumbra::test
